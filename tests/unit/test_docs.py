"""The generated pages are as generated, and every promise of the way from DUNE exists."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from companion import cli
from companion.cli import COMMANDS
from companion.core.hull import VesselConfig
from companion.core.nmea.sentences import KINDS
from companion.gateway import GatewaySettings
from companion.imc.settings import ImcSettings
from companion.settings import params
from companion.settings.schema import Settings
from mavlink_bridge.language import messages as imc, requests
from mavlink_bridge.mavlink.wire.codec import dialect
from sitl.world.settings import WorldConfig
from tools import from_dune, generate_docs
from tools.schema_text import keys, texts_of

REPO = Path(__file__).resolve().parents[2]
DOCS = REPO / "docs"
KEYS = {key.path for key in keys(Settings)}


def test_the_generated_pages_are_up_to_date():
    stale = [path.name for path, text in generate_docs.wanted(DOCS).items() if path.read_text(encoding="utf-8") != text]
    assert not stale, f"run 'make docs' and commit {', '.join(stale)}"


def test_every_sentence_that_is_understood_stands_in_the_page_of_sensors():
    """Of a proprietary one its maker's name, which the page shows with a comma."""
    page = (DOCS / "SENSORS.md").read_text(encoding="utf-8")
    told = page[page.index("## Sentences") :].replace(",", "")
    assert not [kind for kind in KINDS if kind not in told and kind[:4] not in told]


def test_every_key_and_every_parameter_has_a_meaning():
    silent = [
        key.path
        for model in (Settings, WorldConfig, GatewaySettings, ImcSettings, VesselConfig)
        for key in keys(model)
        if not key.text.strip()
    ]
    silent += [entry.param.name for entry in params.entries(Settings) if not entry.text.strip()]
    assert not silent, "a sentence below the field says what it is for"


def test_every_parameter_and_key_is_on_its_page():
    text = (DOCS / "PARAMETERS.md").read_text()
    assert all(f"`{entry.param.name}`" in text for entry in params.entries(Settings))
    text = (DOCS / "CONFIGURATION.md").read_text()
    assert all(f"`{path.rpartition('.')[2]}`" in text for path in KEYS)


@pytest.mark.parametrize("item", from_dune.SETTINGS, ids=lambda item: f"{item.task}-{item.name}")
def test_a_dune_parameter_has_a_key(item):
    assert item.key in KEYS or any(path.startswith(f"{item.key}.") for path in KEYS), item.key


@pytest.mark.parametrize("item", from_dune.TRIALS, ids=lambda item: item.what[:40])
def test_a_dune_test_has_a_test(item):
    path, _, name = item.test.partition("::")
    text = (REPO / path).read_text()
    assert not name or f"def {name}(" in text


def test_dune_modules_and_tasks_exist():
    assert all((REPO / path).is_file() for task in from_dune.TASKS for path in task.modules)
    assert {item.task for item in from_dune.SETTINGS} == {task.name for task in from_dune.TASKS}


@pytest.mark.parametrize("item", from_dune.MESSAGES, ids=lambda item: item.name)
def test_a_dune_message_has_its_form_inside_and_on_the_wire(item):
    places = {"imc": imc, "requests": requests}
    for module, name in re.findall(r"`(imc|requests)\.(\w+)", item.here):
        assert hasattr(places[module], name), name
    commands = {entry.name for entry in dialect.enums["MAV_CMD"].values()}
    for name in re.findall(r"\b[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)+\b", item.mavlink):
        spoken = {f"MAV_CMD_{prefix}{name}" for prefix in ("", "NAV_", "DO_")} & commands
        assert spoken or hasattr(dialect, f"MAVLINK_MSG_ID_{name}"), name


COMMAND = re.compile(r"^(?:\S*/)?companion ([a-z][^#]*?)(?:\s{2,}.*|\s*#.*|\s*\|.*)?$", re.MULTILINE)


def written_commands():
    for page in [*sorted(DOCS.glob("*.md")), REPO / "README.md"]:
        for block in re.findall(r"^```\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE):
            yield from ((page.name, words) for words in COMMAND.findall(block))


@pytest.mark.parametrize(("page", "words"), list(written_commands()))
def test_a_command_in_the_pages_is_understood(page, words):
    """Every option and sub-command that a page shows exists, with as many words as it needs."""
    words = shlex.split(re.sub(r"\b(?:RUN_DIR|RUN|FILE|F)\b", "x", words))
    arguments = cli._parser(words[0]).parse_args(words)
    assert hasattr(arguments, "run")


@pytest.mark.parametrize("page", [*sorted(DOCS.glob("*.md")), REPO / "README.md"], ids=lambda page: page.name)
def test_links_and_paths_in_the_pages_exist(page):
    text = page.read_text(encoding="utf-8")
    for target, heading in re.findall(r"\]\(([^)#:]+)(?:#([^)]*))?\)", text):
        assert (page.parent / target).exists(), f"{page.name}: {target}"
        if heading:
            titles = re.findall(r"^#+ (.*)$", (page.parent / target).read_text(encoding="utf-8"), flags=re.MULTILINE)
            assert heading in [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles], heading


@pytest.mark.parametrize("page", [*sorted(DOCS.glob("*.md")), REPO / "README.md"], ids=lambda page: page.name)
def test_commands_in_the_pages_exist(page):
    text = page.read_text(encoding="utf-8")
    known = {*COMMANDS, "sim"}
    used = set(re.findall(r"(?:^|`|/)companion ([a-z][a-z-]+)", text, flags=re.MULTILINE))
    assert used <= known, used - known


def test_the_tests_that_the_pages_name_exist():
    pages = [(DOCS / name).read_text(encoding="utf-8") for name in ("SEED.md", "NEPTUS.md")]
    for path, name in re.findall(r"`(\w+/test_\w+\.py)(?:::(\w+))?`", "".join(pages)):
        text = (REPO / "tests" / path).read_text(encoding="utf-8")
        assert not name or f"def {name}(" in text, f"{path}::{name}"


def test_every_page_is_reached_from_the_readme():
    text = (REPO / "README.md").read_text(encoding="utf-8")
    assert not [page.name for page in DOCS.glob("*.md") if f"docs/{page.name}" not in text]


def test_keys_named_in_the_hand_written_pages_exist():
    for name in ("SAFETY.md", "COMMISSIONING.md", "TROUBLESHOOTING.md", "RASPBERRY.md"):
        text = (DOCS / name).read_text(encoding="utf-8")
        for key in re.findall(r"`([a-z_]+(?:\.[a-z_0-9]+)+)`", text):
            if not key.endswith((".db", ".toml", ".csv", ".tlog", ".jsonl", ".html", ".txt", ".py")):
                assert key in KEYS, f"{name}: {key}"


def test_texts_below_fields_are_read():
    from companion.core.vehicle.config import SystemConfig

    assert "actuator refresh rate" in texts_of(SystemConfig)["tick_hz"]


def test_the_unit_feeds_the_watchdog_and_never_stays_dead():
    unit = (REPO / "config" / "system" / "usv-companion.service").read_text()
    for line in ("Type=notify", "WatchdogSec=2", "Restart=always", "StartLimitIntervalSec=0", "ProtectSystem=strict"):
        assert line in unit


def test_no_device_of_the_vessel_is_spoken_to_by_the_modem_manager():
    rules = (REPO / "config" / "system" / "60-usv-companion.rules").read_text().splitlines()
    devices = [rule for rule in rules if rule and not rule.startswith("#")]
    assert len(devices) >= 3
    assert all('ENV{ID_MM_DEVICE_IGNORE}="1"' in rule for rule in devices)


def test_the_unit_leaves_the_state_to_its_user_and_his_group():
    """Without a word of its own the folder that the installer made 0750 was 0755 after the first start."""
    unit = (REPO / "config" / "system" / "usv-companion.service").read_text().splitlines()
    assert "StateDirectoryMode=0750" in unit


def test_the_scenario_in_its_page_holds_as_printed(tmp_path, capsys):
    text = (DOCS / "SCENARIOS.md").read_text(encoding="utf-8")
    (block,) = [
        found for found in re.findall(r"^```toml\n(.*?)^```", text, re.DOTALL | re.MULTILINE) if "[scenario]" in found
    ]
    (tmp_path / "printed.toml").write_text(block, encoding="utf-8")
    assert cli.main(["sim", "--scenario", str(tmp_path / "printed.toml")]) == 0
    assert capsys.readouterr().out.splitlines()[-2] == "passed"


def test_the_page_of_the_configuration_knows_the_world_and_the_gateway():
    text = (DOCS / "CONFIGURATION.md").read_text(encoding="utf-8")
    tables = dict(re.findall(r"^## \[?([^\]\n]*)\]?\n(.*?)(?=^#|\Z)", text, re.DOTALL | re.MULTILINE))
    assert "`current_mps`" in tables["world.water"]
    assert "`vessel_config`" in tables["At the top of a gateway's file"]
    assert "`delay_s`" in tables["failsafe.conditions.NAME"]
    assert "| `gcs_action` | `warn`, `hold`, `return`, `stop` |" in tables["failsafe"]
    assert "<" not in "".join(row.split("|")[2] for row in text.splitlines() if row.startswith("| `"))


def test_keys_that_pages_give_an_endpoint_exist():
    text = (DOCS / "GROUND-STATIONS.md").read_text(encoding="utf-8")
    named = re.findall(r"`([a-z_]+)` of an endpoint", text)
    assert all(f"endpoints.{name}" in KEYS for name in named)


def test_every_file_of_a_run_is_named():
    text = (DOCS / "RECORDINGS.md").read_text(encoding="utf-8")
    for name in ("run.json", "mavlink.tlog", "inputs.bin", "events.jsonl", "control.csv", "truth.csv", "board.csv"):
        assert f"| `{name}` |" in text


def test_every_proof_that_security_names_exists():
    text = (REPO / "SECURITY.md").read_text()
    named = set(re.findall(r"`(tests/[\w/.]+)`", text)) | set(re.findall(r"`(tests/[\w/.]+\.py)", text))
    assert len(named) > 8
    assert [name for name in sorted(named) if not (REPO / name).exists()] == []
