"""Equal seeds give equal bytes; different seeds do not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from companion.cli import main
from tests.plans import LOITER_PLAN

FILES = ("truth.csv", "control.csv", "inputs.bin", "events.jsonl", "mavlink.tlog")


def sail(tmp_path: Path, name: str, seed: int, duration_s: int = 120) -> Path:
    plan = tmp_path / "loiter.plan"
    plan.write_text(json.dumps(LOITER_PLAN))
    run_dir = tmp_path / name
    words = ["sim", "--plan", str(plan), "--start", "--speed", "max", "--duration", str(duration_s)]
    assert main([*words, "--seed", str(seed), "--run-dir", str(run_dir), "--json"]) == 0
    return run_dir


def test_equal_seeds_give_equal_bytes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, two, other = sail(tmp_path, "one", 7), sail(tmp_path, "two", 7), sail(tmp_path, "other", 8, duration_s=30)
    for name in FILES:
        assert (one / name).read_bytes() == (two / name).read_bytes(), name
    otherwise = (other / "truth.csv").read_bytes()
    assert (one / "truth.csv").read_bytes()[: len(otherwise)] != otherwise
    summary = json.loads(capsys.readouterr().out.splitlines()[0])
    assert summary["plan_state"] == "COMPLETE"
    circle = next(item for item in summary["items"] if item["kind"] == "circular")
    assert circle["truth"]["rms_m"] < 0.5
