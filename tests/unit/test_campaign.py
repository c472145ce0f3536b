"""Campaigns: all combinations, resumable, a broken run is a row, and mistakes are found before anything runs."""

from __future__ import annotations

import csv
import json

import pytest

from companion.cli import main
from companion.settings import ConfigError
from sitl.campaign import Job, read_campaign, run_campaign, summary

SHORT = """
[scenario]
title = "At rest"
duration_s = 3
[[expect]]
stays_neutral = true
[[expect]]
speed_mps_max = 0.2
"""
CAMPAIGN = '[campaign]\nscenarios = ["short.toml"]\nseeds = [1, 2, 3]\nvessels = ["otter", "blueboat"]\n'


@pytest.fixture
def path(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    file = tmp_path / "all.toml"
    file.write_text(CAMPAIGN)
    return file


def rows(path):
    with path.with_suffix(".csv").open() as file:
        return list(csv.DictReader(file))


def test_all_combinations_by_the_command_over_two_processes(path, capsys):
    assert main(["sim", "--campaign", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["passed"] == 6
    assert {(row["vessel"], row["seed"]) for row in rows(path)} == {
        (v, s) for v in ("otter", "blueboat") for s in "123"
    }


def test_it_goes_on_with_what_is_missing(path):
    jobs = read_campaign(path)
    results = path.with_suffix(".csv")
    first = run_campaign(jobs[:2], results, workers=1)
    with results.open("a") as file:
        file.write("short.toml,ott")  # the power went in the middle of a row
    told = []
    every = run_campaign(jobs, results, workers=1, done=lambda done, all_: told.append((done, all_)))
    assert told[0] == (2, 6)
    assert told[-1] == (6, 6)
    assert every[:2] == first
    assert run_campaign(jobs, results, workers=1) == every, "nothing left to do"


def test_a_failure_and_a_broken_run_are_rows(path, tmp_path):
    hard = tmp_path / "hard.toml"
    hard.write_text(SHORT.replace("speed_mps_max = 0.2", "speed_mps_min = 5.0"))
    found = run_campaign(
        [Job(str(hard), "", 1), Job(str(tmp_path / "gone.toml"), "", 1)], tmp_path / "out.csv", workers=1
    )
    assert "speed_mps_min" in found[0]["failed"]
    assert "ConfigError" in found[1]["failed"]
    assert [row["passed"] for row in found] == ["0", "0"]
    assert any("0/1" in line for line in summary(found))


def test_mistakes_come_before_anything_runs(path):
    path.write_text('[campaign]\nscenarios = ["nowhere.toml", "first-lighter"]\nvessels = ["barge"]\n')
    with pytest.raises(ConfigError) as caught:
        read_campaign(path)
    text = " ".join(caught.value.mistakes)
    assert "nowhere.toml" in text
    assert "first-lighter" in text
    path.write_text("[campaign]\nseed = 1\n")
    with pytest.raises(ConfigError, match="no such key"):
        read_campaign(path)
