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
