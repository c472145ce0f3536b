"""``companion explain failsafe``: the table, a configuration's own, and what a chain of events leads to."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from companion.commands.check import explain
from companion.core.guard.failsafe import FailsafeConfig, failsafe_table_markdown
from companion.core.guard.failsafe_table import TABLE


def run(*words: str) -> int:
    parser = argparse.ArgumentParser()
    explain.register(parser.add_subparsers())
    arguments = parser.parse_args(["explain", "failsafe", *words])
    return arguments.run(arguments)


def test_the_table_is_printed(capsys):
    assert run() == 0
    assert capsys.readouterr().out == failsafe_table_markdown()


def test_with_a_configuration_its_own_values_are_shown(capsys, tmp_path):
    file = tmp_path / "boat.toml"
    file.write_text('[failsafe]\ngcs_timeout_s = 7.0\n[failsafe.conditions.fence_breach]\naction = "STOP"\n', "utf-8")
    assert run(str(file)) == 0
    out = capsys.readouterr().out
    assert "| `gcs_lost`: ground station lost | 7 | HOLD |" in out
    assert "| `fence_breach`: outside the fence | 0 | STOP |" in out


def test_a_chain_of_events_is_played(capsys):
    assert run("--play", "0:armed,autonomous", "5:position_lost", "20:-position_lost", "26:operator_order") == 0
    assert capsys.readouterr().out.splitlines() == [
        "   0.00 s  => NONE (all well)",
        "   5.00 s  critical: Position lost: STOP",
        "   5.00 s  info: Until position is back, then order Auto",
        "   5.00 s  => STOP (position_lost)",
        "  26.00 s  info: Over: position lost",
        "  26.00 s  => NONE (all well)",
    ]


def test_ages_can_be_set_and_taken_back():
    lines = explain.play(["0:armed,gcs_required,gcs_age_s=5", "1:gcs_age_s=0,operator_arm"], FailsafeConfig(), 1.0)
    assert lines[-1] == "   1.00 s  => WARN (gcs_degraded)"
    assert explain.play(["0:armed,manual_age_s=9", "1:manual_age_s"], FailsafeConfig(), 1.0)[-1].endswith("(all well)")


@pytest.mark.parametrize(
    "word", ["0:gps", "x:armed", "inf:", "nan:armed", "1e9:armed", "-1:armed", "0:armed=abc", "0:gcs_age_s=nan"]
)
def test_what_is_no_event_is_named(capsys, word):
    words = ["--play=" + word] if word.startswith("-") else ["--play", word]
    assert run(*words) == 2
    told = capsys.readouterr().err
    assert word.partition(":")[2].partition("=")[0] in told
    assert told.count("\n") == 1


def test_all_that_is_no_event_is_named_at_once(capsys):
    assert run("--play", "0:gps", "1:armed", "nan:armed") == 2
    told = capsys.readouterr().err
    assert "'gps' is no flag" in told
    assert "'nan:armed': SECONDS:FLAG expected, seconds from 0 to 36000" in told


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.name)
def test_every_condition_is_in_the_safety_page(row):
    page = Path(__file__).resolve().parents[2] / "docs" / "SAFETY.md"
    assert f"`{row.name}`" in page.read_text("utf-8")
