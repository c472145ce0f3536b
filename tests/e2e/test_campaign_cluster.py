"""A campaign over a real Dask cluster: the same results as here, also when a worker is killed; no cluster is said in one line."""

from __future__ import annotations

import csv
import importlib.util
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from companion.commands import MissingExtraError
from sitl.campaign import cluster as campaign_cluster
from sitl.campaign.campaign import read_campaign, run_campaign
from sitl.campaign.cluster import over_cluster
from sitl.campaign.work import CampaignError
from tests.conftest import REPO, require

pytestmark = pytest.mark.e2e
COMPANION = Path(sys.executable).parent / "companion"
CAMPAIGN = '[campaign]\nscenarios = ["short.toml"]\nseeds = [1, 2, 3, 4, 5, 6, 7, 8]\n'
SHORT = """
[scenario]
title = "A way-point"
duration_s = 20
[[plan.item]]
goto = { north_m = 100.0, east_m = 0.0 }
[[expect]]
speed_mps_min = 0.5
[[expect]]
distance_sailed_m_min = 5.0
"""


@pytest.fixture
def campaign(tmp_path):
    path = tmp_path / "all.toml"
    path.write_text(CAMPAIGN)
    (tmp_path / "short.toml").write_text(SHORT)
    return path


@pytest.fixture
def cluster():
    require(importlib.util.find_spec("distributed") is not None, "distributed (extra 'cluster')")
    with subprocess.Popen(
        [sys.executable, "-m", "tests.e2e.cluster"], cwd=REPO, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield json.loads(process.stdout.readline())
        process.stdin.close()


def known(rows):
    """What was found, by seed: all of a row but the time that it took."""
    return {int(row["seed"]): (row["passed"], row["distance_m"], row["findings"]) for row in rows}


def rows_in(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_two_workers_find_what_this_computer_finds_even_when_one_is_killed(campaign, cluster, tmp_path):
    results = campaign.with_suffix(".csv")
    with subprocess.Popen(
        [COMPANION, "sim", "--campaign", campaign, "--cluster", cluster["address"], "--json"], stdout=subprocess.PIPE
    ) as process:
        deadline = time.monotonic() + 60
        while not (results.is_file() and rows_in(results)) and time.monotonic() < deadline:
            time.sleep(0.02)
        os.kill(cluster["pids"][0], signal.SIGKILL)
        told = json.loads(process.stdout.read())
    assert process.returncode == 0
    assert told["runs"] == told["passed"] == 8
    assert known(rows_in(results)) == known(run_campaign(read_campaign(campaign), tmp_path / "here.csv"))


def test_a_cluster_that_is_not_there_is_said(campaign):
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"
        with pytest.raises(CampaignError, match=f"{address}: no Dask scheduler answers there"):
            list(over_cluster(read_campaign(campaign), address, patience_s=0.5))


def test_the_command_says_no_cluster_no_address_and_no_campaign(campaign, capsys, monkeypatch):
    from companion.cli import main

    monkeypatch.setattr(campaign_cluster, "PATIENCE_S", 0.5)
    words = ["sim", "--campaign", str(campaign), "--cluster"]
    assert main([*words, "tcp://127.0.0.1:9"]) == 1
    assert "0 of 8 runs are done" in capsys.readouterr().err
    assert main([*words, "somewhere"]) == 2
    assert "tcp://host:8786" in capsys.readouterr().err
    assert main(["sim", "--cluster", "tcp://127.0.0.1:9"]) == 2
    assert "needs --campaign" in capsys.readouterr().err


def test_the_missing_extra_names_its_install_line(campaign, monkeypatch):
    monkeypatch.setattr(campaign_cluster.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"pip install '\.\[cluster\]'"):
        list(over_cluster(read_campaign(campaign), "tcp://127.0.0.1:9"))
