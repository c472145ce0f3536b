"""A configuration is judged in one go: what no schema can see is told beside wrong types, ranges and keys."""

from __future__ import annotations

from pathlib import Path

import pytest

import config
from companion.cli import main
from companion.configuration import gateway_settings, vessel_settings
from companion.settings import ConfigError

EVERYTHING_WRONG = """
vessel = "submarine"
vesel = "otter"
[system]
system_id = 0
[[sensors]]
url = "tcp://nowhere"
[[endpoints]]
name = "open"
url = "udp-listen://0.0.0.0:14550"
[[endpoints]]
name = "strange"
url = "udq://10.0.0.1:1"
[[endpoints]]
name = "unsigned"
url = "udp-listen://0.0.0.0:14551"
link_class = "sigend"
[radio]
url = "/dev/ttyUSB0"
profile = "smoke-signals"
"""
EXPECTED = (
    "system.system_id = 0",
    "vesel: no such key",
    "sensors.0.url = 'tcp://nowhere'",
    "endpoints.0 (open): udp-listen://0.0.0.0:14550 can be reached by other machines",
    "endpoints.1.url = 'udq://10.0.0.1:1'",
    "endpoints.2.link_class = 'sigend'",
    "radio.profile = 'smoke-signals'",
    "vessel = 'submarine'",
)


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    path = tmp_path / "wrong.toml"
    path.write_text(EVERYTHING_WRONG)
    return path


def test_wrong_values_addresses_files_and_open_doors_are_told_together(wrong: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        vessel_settings(wrong, ())
    for start in EXPECTED:
        assert [mistake for mistake in caught.value.mistakes if mistake.startswith(start)], start
    assert len(caught.value.mistakes) == len(EXPECTED)


@pytest.mark.parametrize("command", [["check"], ["run"], ["sim", "--speed", "0", "--start", "--config"]])
def test_every_command_tells_them_and_opens_nothing(
    wrong: Path, command: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(wrong.parent)
    assert main([*command, str(wrong)]) == 2
    said = capsys.readouterr()
    assert all(start in said.err for start in EXPECTED)
    assert ("--start: needs --plan" in said.err) == ("--start" in command)
    assert said.out == ""
    assert [path.name for path in wrong.parent.iterdir()] == [wrong.name]


def test_a_gateway_is_judged_as_whole(capsys: pytest.CaptureFixture[str]) -> None:
    overrides = ["url=udq:3", "profile=smoke-signals", "system_id=0"]
    with pytest.raises(ConfigError) as caught:
        gateway_settings(config.path("gateway.toml"), overrides)
    assert len(caught.value.mistakes) == 3
    sets = [word for item in overrides for word in ("--set", item)]
    assert main(["gateway", str(config.path("gateway.toml")), *sets]) == 2
    assert all(mistake in capsys.readouterr().err for mistake in caught.value.mistakes[:1])


def test_a_missing_key_hides_nothing_but_what_hangs_on_it(tmp_path: Path) -> None:
    """An endpoint without a name cannot be left out without moving those behind it: only the schema speaks then."""
    path = tmp_path / "nameless.toml"
    path.write_text('[[endpoints]]\nurl = "udq://10.0.0.1:1"\n')
    with pytest.raises(ConfigError, match="name: missing") as caught:
        vessel_settings(path, ())
    assert len(caught.value.mistakes) == 1
