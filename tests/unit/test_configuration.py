"""A configuration is judged in one go: what no schema can see is told beside wrong types, ranges and keys."""

from __future__ import annotations

from pathlib import Path

import pytest

import config
from companion.cli import main
from companion.configuration import gateway_settings, vessel_settings
from companion.settings.schema import ConfigError

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
    "sensors number 1 url = 'tcp://nowhere'",
    "endpoints 'open' url = 'udp-listen://0.0.0.0:14550': can be reached by other machines",
    "endpoints 'strange' url = 'udq://10.0.0.1:1'",
    "endpoints 'unsigned' link_class = 'sigend'",
    'radio: protocol = "mavlink" has no key',
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
        assert [mistake for mistake in caught.value.mistakes if start in mistake], start
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
    path = tmp_path / "nameless.toml"
    path.write_text('[[sensors]]\nurl = "/dev/ttyS0"\n[[endpoints]]\nurl = "udq://10.0.0.1:1"\n')
    with pytest.raises(ConfigError) as caught:
        vessel_settings(path, ())
    told = list(caught.value.mistakes)
    assert [mistake[:41] for mistake in told] == [
        "line 3: endpoints number 1 name: missing;",
        "line 4: endpoints number 1 url = 'udq://1",
    ]


SAILED = """
[steering]
profile = "{profile}"
[depth.map]
file = "{chart}"
[radio]
url = "/dev/ttyUSB0"
protocol = "compact"
[[sensors]]
url = "tcp://127.0.0.1:3000"
nmea.sentences = "GGA, FOO"
[[endpoints]]
name = "one"
url = "tcp-listen://127.0.0.1:5760"
[[endpoints]]
name = "two"
url = "tcp-listen://0.0.0.0:5760"
link_class = "telemetry"
"""


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(
    ("profile", "told"),
    [
        ("seed", "set steering.seed.heading_gains and steering.seed.speed_gains"),
        ("foo", "use 'seed', 'model' or 'module:Class'"),
        ("nomod:Class", "cannot be loaded: No module named 'nomod'"),
        ("os:getcwd", "cannot be made: TypeError"),
        ("companion.core.hull.handling:Handling", "cannot be made: "),
    ],
)
def test_what_would_end_a_run_is_told_before_it(
    command: str,
    profile: str,
    told: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    chart = tmp_path / "chart.xyz"
    chart.write_bytes(bytes(range(256)))
    path = tmp_path / "boat.toml"
    path.write_text(SAILED.format(profile=profile, chart=chart))
    assert main([command, str(path)]) == 2
    said = capsys.readouterr().err
    assert f"steering.profile = '{profile}': " in said
    assert told in said
    assert f"depth.map.file = '{chart}': holds no text" in said
    assert "radio.key_file is empty" in said
    assert "sensors number 1 nmea.sentences = 'GGA, FOO': no sentence FOO here" in said
    assert "endpoints 'two' url = 'tcp-listen://0.0.0.0:5760': endpoints 'one' url listens on port 5760 already" in said
    assert "5 mistake(s)" in said
    assert sorted(item.name for item in tmp_path.iterdir()) == ["boat.toml", "chart.xyz"]


@pytest.mark.parametrize(("chart", "told"), [("nowhere.xyz", "No such file"), (".", "Is a directory")])
def test_a_chart_that_is_not_there_is_told(
    chart: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(config.path("boat.toml")), "--set", f"depth.map.file={tmp_path / chart}"]
    assert main(["check", *words]) == 2
    assert f"depth.map.file = '{tmp_path / chart}': {told}" in capsys.readouterr().err


def test_a_key_may_be_made_later_but_not_after_the_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shore, vessel = str(config.path("gateway.toml")), str(config.path("boat.toml"))
    radio = ["radio.url=serial:/dev/ttyUSB0", "radio.protocol=compact", "radio.key_file=radio.key"]
    sets = [word for item in radio for word in ("--set", item)]
    assert main(["check", vessel, *sets]) == 0
    assert main(["check", shore]) == 0
    capsys.readouterr()
    assert main(["run", vessel, *sets]) == 2
    assert main(["gateway", shore, "--set", "system_id=0"]) == 2
    assert list(tmp_path.iterdir()) == []
    said = capsys.readouterr().err
    assert "radio.key_file = 'radio.key': No such file or directory" in said
    assert ": key_file = 'radio.key': No such file or directory" in said


def test_a_mistake_in_the_hulls_file_is_told_with_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hull = tmp_path / "my-hull.toml"
    hull.write_text("length_m = -1\n")
    assert main(["check", str(config.path("boat.toml")), "--set", f"vessel={hull}"]) == 2
    assert f"{hull}: line 1: length_m: no such key; it belongs in [hull]" in capsys.readouterr().err


def test_a_vessel_file_and_a_configuration_that_are_taken_for_each_other_are_told_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    boat, hull = config.path("boat.toml"), config.path("vessels", "otter.toml")
    assert main(["check", str(hull)]) == 2
    said = capsys.readouterr().err.splitlines()
    assert said[0] == f"{hull}: 1 mistake(s)"
    assert "is a vessel file, not a configuration" in said[1]
    assert main(["check", str(boat), "--set", f"vessel={boat}"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert "is a configuration, not a vessel file" in said[1]


@pytest.mark.parametrize(
    ("override", "told"),
    [
        ('failsafe.gcs_action="none"', "failsafe.gcs_action = none: must be at least warn"),
        ('failsafe.gcs_action="DISARM"', "failsafe.gcs_action = disarm: must be at most stop"),
        ("endpoints={}", "endpoints = a table: write [[endpoints]] with two brackets: there may be several"),
        ("depth.map=[]", "depth.map = a list: must be a table: [depth.map], with keys below it"),
        ("system=3", "system = 3: must be a table: [system], with keys below it"),
        ("system.name=[]", "system.name = a list: must be a text, in quotes"),
        ("system.tick_hz=x", "system.tick_hz = 'x': must be a whole number"),
        ("depth.enabled=perhaps", "depth.enabled = 'perhaps': must be true or false"),
        ("depth.min_altitude_m=nan", "depth.min_altitude_m = nan: must be a number"),
    ],
)
def test_a_wrong_kind_of_value_is_told_in_the_files_own_words(
    override: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(config.path("boat.toml")), "--set", override]) == 2
    assert f"  {told}\n" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["boat.toml", "gateway.toml"])
def test_a_file_with_a_byte_order_mark_is_read(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    path.write_text(config.path(name).read_text("utf-8"), "utf-8-sig")
    assert main(["check", str(path)]) == 0
    assert ": good" in capsys.readouterr().out


def test_the_hull_of_the_world_is_judged_by_its_own_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["sim", "--set", "world.vessel=submarine", "--set", "system.system_id=0"]) == 2
    said = capsys.readouterr().err
    assert "  world.vessel = 'submarine': no such file" in said
    assert "2 mistake(s)" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [["check"], ["sim", "--campaign"], ["sim", "--scenario"], ["tune", "margins"]])
def test_a_file_that_cannot_be_read_is_told_without_numbers(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder.toml").mkdir()
    assert main([*words, str(tmp_path / "folder.toml")]) == 2
    assert "Errno" not in capsys.readouterr().err
    noise = tmp_path / "noise.toml"
    noise.write_bytes(b"a = '\xff'")
    assert main([*words, str(noise)]) == 2
    assert "noise.toml" in capsys.readouterr().err
