"""Tests of one group run in one worker, with the runner as it is pinned."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from tests.groups import GROUPS

REPO = Path(__file__).resolve().parents[2]
SIX = "import time, pytest\n@pytest.mark.parametrize('i', range(6))\ndef test_it(i): time.sleep(0.05)\n"


def test_a_group_and_a_module_stay_with_one_worker_and_the_real_clock_is_shared(tmp_path):
    (tmp_path / "tests/e2e").mkdir(parents=True)
    for module in (GROUPS["deadlines"][0], "test_anything", "tests/e2e/test_clock"):
        (tmp_path / f"{module}.py").write_text(SIX)
    words = [
        "-c",
        os.devnull,
        "--rootdir",
        tmp_path,
        "-p",
        "xdist",
        "-p",
        "tests.groups",
        "-p",
        "no:cacheprovider",
        "-n",
        "2",
        "-v",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words, "--dist", "loadgroup", tmp_path],
        cwd=REPO,
        env={**os.environ, "PYTEST_ADDOPTS": "", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    where = re.findall(r"\[(gw\d)\].* PASSED .*?(\w+)\.py::", done.stdout)
    workers = {module: {worker for worker, other in where if other == module} for _, module in where}
    assert len(where) == 18
    assert [len(workers[module]) for module in (GROUPS["deadlines"][0], "test_anything", "test_clock")] == [1, 1, 2]


def test_every_module_of_a_group_is_there():
    there = {path.stem for path in (REPO / "tests").rglob("test_*.py")}
    assert {module for modules in GROUPS.values() for module in modules} <= there
