"""Numbers on the command line: what is none, or cannot be meant, is refused with status 2 before anything happens."""

from __future__ import annotations

from pathlib import Path

import pytest

import config
from companion.cli import main


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """What is printed when the command line is refused."""
    try:
        status: object = main(words)
    except SystemExit as stop:
        status = stop.code
    assert status == 2
    said = capsys.readouterr()
    assert said.out == ""
    return said.err


@pytest.mark.parametrize("command", [["sim"], ["run", str(config.path("boat.toml"))], ["gateway", "g.toml"]])
@pytest.mark.parametrize("value", ["nan", "inf", "-1", "0", "soon", "1e400"])
def test_a_duration_is_a_number_greater_than_0(
    command: list[str], value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert f"argument --duration: {value}: give a number greater than 0" in refused(
        [*command, "--duration", value], capsys
    )
    assert list(tmp_path.iterdir()) == []


MAKE = ["plan", "make", "out.plan", "41.5,-8.7"]
VESSEL = ["--url", "udpin://127.0.0.1:1"]


@pytest.mark.parametrize(
    "words",
    [
        ["tune", "margins", "--delay", "nan"],
        ["tune", "margins", "--delay", "-1"],
        ["tune", "figures", "--speed", "nan"],
        ["tune", "figures", "--speed", "-1"],
        ["tune", "gains", "--delay", "1e9"],
        ["tune", "identify", "x.csv", "--span", "0", "nan"],
        ["depth", "convert", "a.tif", "a.depth", "--pitch", "0"],
        ["depth", "convert", "a.tif", "a.xyz", "--thin", "-5"],
        ["depth", "convert", "a.tif", "a.xyz", "--datum", "nan"],
        ["depth", "forget", "s.db", "--near", "nan", "0", "10"],
        ["depth", "import", "s.db", "x.xyz", "--cell", "nan"],
        [*MAKE, "--radius", "nan"],
        [*MAKE, "--radius", "0"],
        [*MAKE, "--bearing", "inf"],
        [*MAKE, "--duration", "-1"],
        [*MAKE, "--speed", "nan"],
        ["plan", "upload", "x.plan", *VESSEL, "--wait", "nan"],
        ["plan", "upload", "x.plan", *VESSEL, "--wait", "-1"],
        ["plan", "send-json", "x.json", "/dev/null", "--wait", "inf"],
        ["report", ".", "--limit", "gap_s=nan"],
        ["check", str(config.path("boat.toml")), "--live", "nan"],
        ["sim", "--speed", "nan"],
        ["bench-actuators", "--yes", "--period", "nan"],
    ],
    ids=" ".join,
)
def test_what_is_no_number_is_named_and_nothing_is_done(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.xyz").write_text("-8.7 41.5 3.0\n")
    said = refused(words, capsys)
    assert next(word for word in words if word.startswith("--") and word not in ("--url", "--yes")) in said
    assert [path.name for path in tmp_path.iterdir()] == ["x.xyz"]


@pytest.mark.parametrize(
    "words", [["--duration", "1e39"], ["--duration", "1e99"], ["--radius", "1e39"], ["--speed", "1e39"]]
)
def test_a_number_that_no_plan_can_be_sent_with_is_refused_by_its_item(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = refused([*MAKE, *words], capsys)
    assert said.startswith("plan make: 1 mistake(s)\n  item 0 (")
    assert "100000 m\n" in said or " is outside 0 to " in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sim", "--seed", "1.5"], "--seed: 1.5: give a whole number"),
        (["sim", "--instance", "one"], "--instance: one: give a whole number"),
        (["sim", "--encounters", "imazu", "--count", "0"], "--count: 0: give a whole number of at least 1"),
        (["imc", "--beside", "me"], "--beside: me: give a whole number of at least 1"),
        (["depth", "convert", "a", "b", "--band", "0"], "--band: 0: give a whole number of at least 1"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_a_count_is_a_whole_number(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert refused(words, capsys).endswith(f"argument {said}\n")
