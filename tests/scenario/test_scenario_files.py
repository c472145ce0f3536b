"""Every shipped scenario holds, through the API and through the command."""

from __future__ import annotations

import json

import pytest

from companion.cli import main
from sitl.scenario.file import library
from sitl.scenario.run import run_scenario


@pytest.mark.parametrize("path", library(), ids=lambda path: path.stem)
def test_a_shipped_scenario_holds(path):
    outcome = run_scenario(path)
    failed = [finding for finding in outcome.findings if not finding.passed]
    assert outcome.passed, (failed, outcome.texts)


@pytest.mark.soak
@pytest.mark.parametrize("seed", [2, 3, 4, 5])
@pytest.mark.parametrize("path", library(), ids=lambda path: path.stem)
def test_a_shipped_scenario_holds_with_other_seeds(path, seed):
    outcome = run_scenario(path, seed=seed)
    assert outcome.passed, ([finding for finding in outcome.findings if not finding.passed], outcome.texts)


def test_the_command_prints_what_was_found_and_records_the_run(tmp_path, capsys):
    assert main(["sim", "--scenario", "sounder-drop-out", "--run-dir", str(tmp_path / "run"), "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["passed"]
    assert outcome["seed"] == 1
    assert {finding["what"] for finding in outcome["findings"]} >= {"cause, from 20 s", "stays_neutral, from 30 s"}
    assert json.loads((tmp_path / "run" / "run.json").read_text())["scenario"] == "sounder-drop-out"
    assert (tmp_path / "run" / "truth.csv").stat().st_size > 10_000


def test_equal_seeds_find_equal_figures():
    short = "sounder-drop-out"
    once = run_scenario(short, seed=4)
    assert once == run_scenario(short, seed=4)
    assert once.distance_m != run_scenario(short, seed=5).distance_m
