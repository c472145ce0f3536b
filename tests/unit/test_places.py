"""A place that cannot be written or read costs one line with its name and the reason, never a traceback."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

import config
from companion.cli import main
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import Codec, dialect

SIM = ["sim", "--speed", "max", "--duration", "1"]
MAKE = ["41.18,-8.7", "41.19,-8.7"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a file that is in the way, a plan and a log."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("in the way")
    assert main(["plan", "make", "good.plan", *MAKE]) == 0
    assert main(["plan", "make", "loiter.plan", MAKE[0], "--speed", "1.5"]) == 0
    codec = Codec(1, 1)
    beat = dialect.MAVLink_heartbeat_message(11, 3, 129, 0, 4, 3)
    frames = [codec.encode(beat) for _ in range(3)]
    (tmp_path / "log.tlog").write_bytes(b"".join(tlog.pack(10**15 + n, 0, frame) for n, frame in enumerate(frames)))
    (tmp_path / "campaign.toml").write_text('[campaign]\nscenarios = ["first-loiter"]\n')
    (tmp_path / "campaign.csv").mkdir()
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ["check", "/dev/zero"],
        ["check", str(config.path("boat.toml")), "--set", "depth.map.file=/dev/zero"],
        ["plan", "check", "/dev/zero"],
        ["plan", "extract", "/dev/zero", "x.plan"],
        ["sim", "--plan", "/dev/zero"],
        ["sim", "--campaign", "/dev/zero"],
        ["depth", "import", "a.db", "/dev/zero"],
        ["store", "import", "a.db", "/dev/zero"],
        ["report", "/dev/zero"],
    ],
    ids=" ".join,
)
def test_what_has_no_end_is_not_read(words: list[str], here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, memory[1]))  # or a failure of this test would eat the computer
    try:
        assert main(words) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_AS, memory)
    assert "is a device; name a file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["replay", "nothing"], 2, "nothing: holds no recording (inputs.bin); give a run's folder"),
        (["replay", "file"], 2, "file: not a recording of inputs, or one of another version"),
        (["lora", "show", "/dev/null"], 1, "/dev/null: is no serial line; name the module's port, as /dev/ttyUSB0"),
    ],
    ids=str,
)
def test_what_is_of_another_kind_is_told_once_and_in_words(
    words: list[str], status: int, said: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "nothing").mkdir()
    capsys.readouterr()
    assert main(words) == status
    assert capsys.readouterr().err.removeprefix("companion lora: ") == f"{said}\n"


@pytest.mark.parametrize(
    ("words", "place"),
    [
        ([*SIM, "--run-dir", "file"], "file"),
        ([*SIM, "--run-dir", "file/run"], "file/run"),
        ([*SIM, "--run-dir", "/proc/x"], "/proc/x"),
        (["sim", "--scenario", "first-loiter", "--run-dir", "file"], "file"),
        (["sim", "--campaign", "campaign.toml"], "campaign.csv"),
        (["report", "log.tlog", "-o", "nowhere/a.html"], "nowhere/a.html"),
        (["report", "log.tlog", "-o", "."], "."),
        (["plan", "check", "good.plan", "--svg", "nowhere/a.svg"], "nowhere/a.svg"),
        (["plan", "convert", "good.plan", "nowhere/a.plan"], "nowhere/a.plan"),
        (["plan", "convert", "loiter.plan", "file/a.json"], "file/a.json"),
        (["plan", "make", "nowhere/a.plan", *MAKE], "nowhere/a.plan"),
        (["tune", "gains", "-o", "nowhere/gains.toml"], "nowhere/gains.toml"),
        (["tune", "figures", "-o", "file"], "file"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_place_that_cannot_be_written_is_named(
    words: list[str], place: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(words) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith(f"{place}: ")
    assert said.endswith("; name another place, or see that this one is there and may be written")


@pytest.mark.parametrize(
    "words",
    [
        ["report", "nowhere.tlog"],
        ["plan", "extract", "nowhere.tlog", "a.plan"],
        ["plan", "extract", ".", "a.params"],
        ["plan", "check", "."],
        ["tune", "identify", "nowhere.csv"],
        ["tune", "identify", "file"],
        ["tune", "margins", "nowhere.toml"],
        ["store", "show", "nowhere.db"],
        ["depth", "show", "nowhere.db"],
        ["depth", "import", "s.db", "nowhere.xyz"],
        ["depth", "convert", "nowhere.tif", "a.xyz"],
        ["keys", "check", "nowhere.key"],
        ["keys", "show", "file"],
        ["replay", "nowhere"],
        ["check", "nowhere.toml"],
        ["check", str(config.path("boat.toml")), "--set", "vessel=nowhere.toml"],
        ["sim", "--campaign", "nowhere.toml"],
    ],
    ids=" ".join,
)
def test_a_file_that_is_missing_or_another_kind_is_wrong_usage(
    words: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(words) == 2
    said = capsys.readouterr()
    assert any(name in said.err for name in (*words[1:], "nowhere")), said.err
    assert said.out == ""
