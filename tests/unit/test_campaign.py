"""Campaigns: all combinations, resumable, a broken run is a row, a killed worker's runs are done again, and mistakes come first."""

from __future__ import annotations

import csv
import json
import os
import shutil

import pytest

import config as shipped
from companion.cli import main
from companion.settings.schema import ConfigError
from sitl.campaign import work as campaign_work
from sitl.campaign.campaign import read_campaign, run_campaign, summary
from sitl.campaign.page import command, make_page
from sitl.campaign.work import CampaignError, over_cores, run_job

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
    assert "6 within limits" in path.with_suffix(".html").read_text()
    assert {(row["vessel"], row["seed"]) for row in rows(path)} == {
        (v, s) for v in ("otter", "blueboat") for s in "123"
    }


def one_core(jobs):
    return map(run_job, jobs)


def test_it_goes_on_with_what_is_missing(path):
    jobs = read_campaign(path)
    results = path.with_suffix(".csv")
    first = run_campaign(jobs[:2], results, work=one_core)
    with results.open("a") as file:
        file.write("short.toml,ott")  # the power went in the middle of a row
    told = []
    every = run_campaign(jobs, results, work=one_core, done=lambda done, all_: told.append((done, all_)))
    assert told[0] == (2, 6)
    assert told[-1] == (6, 6)
    assert every[:2] == first
    assert run_campaign(jobs, results, work=lambda jobs: pytest.fail("nothing is left to do")) == every


def test_a_result_stands_only_for_what_it_rests_on(path, tmp_path):
    """A changed scenario or hull, or another program, is another run."""
    results = path.with_suffix(".csv")
    path.write_text('[campaign]\nscenarios = ["short.toml"]\nvessels = ["", "hull.toml"]\n')
    hull = tmp_path / "hull.toml"
    shutil.copy(shipped.path("vessels", "otter.toml"), hull)
    run_campaign(read_campaign(path), results, work=one_core)
    hull.write_text(hull.read_text() + "\n# said otherwise, but the same hull\n")
    done = []
    run_campaign(read_campaign(path), results, work=one_core, done=lambda *told: done.append(told))
    assert done == [(2, 2)]
    (tmp_path / "short.toml").write_text(SHORT.replace("0.2", "0.3"))
    done.clear()
    run_campaign(read_campaign(path), results, work=one_core, done=lambda *told: done.append(told))
    assert done[0] == (0, 2)


def test_a_table_of_another_kind_is_not_touched(path):
    path.with_suffix(".csv").write_text("name,age\nA,3\n")
    with pytest.raises(ConfigError, match="not a table"):
        run_campaign(read_campaign(path), path.with_suffix(".csv"))
    assert path.with_suffix(".csv").read_text() == "name,age\nA,3\n"


def test_a_failure_and_a_broken_run_are_rows(path, tmp_path):
    (tmp_path / "hard.toml").write_text(SHORT.replace("speed_mps_max = 0.2", "speed_mps_min = 5.0"))
    shutil.copy(shipped.path("vessels", "otter.toml"), tmp_path / "hull.toml")
    path.write_text('[campaign]\nscenarios = ["hard.toml"]\nvessels = ["", "hull.toml"]\n')
    jobs = read_campaign(path)
    (tmp_path / "hull.toml").unlink()  # gone between the check and its run
    found = run_campaign(jobs, tmp_path / "out.csv", work=one_core)
    assert "speed_mps_min" in found[0]["failed"]
    assert "ConfigError" in found[1]["failed"]
    assert [row["passed"] for row in found] == ["0", "0"]
    assert any("0/1" in line for line in summary(found))
    text = make_page("out", found, len(jobs))
    assert "2 failed" in text
    assert "companion sim --scenario hard.toml --seed 1" in text
    assert command(found[1]).endswith("'vessel=\"hull.toml\"'")


def die_once(job):
    """In place of a run: the first one kills its worker process, as the kernel does when memory is short."""
    try:
        os.close(os.open(os.environ["DIED_FILE"], os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return run_job(job)
    os._exit(9)


def always_die(job):
    os._exit(9)


def test_the_runs_of_a_killed_worker_are_done_again(path, tmp_path, monkeypatch):
    path.write_text('[campaign]\nscenarios = ["short.toml"]\nseeds = [1, 2, 3, 4]\n')
    monkeypatch.setattr(campaign_work, "run_job", die_once)
    monkeypatch.setenv("DIED_FILE", str(tmp_path / "died"))
    found = {row.seed: row.passed for row in over_cores(read_campaign(path), workers=2)}
    assert (tmp_path / "died").exists()
    assert found == {1: 1, 2: 1, 3: 1, 4: 1}


def test_workers_that_always_die_end_the_campaign(path, monkeypatch):
    monkeypatch.setattr(campaign_work, "run_job", always_die)
    monkeypatch.setattr(campaign_work, "ROUNDS_WITHOUT_A_RUN", 1)
    with pytest.raises(CampaignError, match="6 not done"):
        list(over_cores(read_campaign(path), workers=2))


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
