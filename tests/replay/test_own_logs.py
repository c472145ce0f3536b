"""Our own missions with MAVSDK as the ground station: its half of the log, said to a fresh vessel, brings the vessel's half.

The logs are in tests/data and need nothing else (``record_tlogs.py`` made them from live runs). Answers must be equal field by
field; modes and texts must come in the same order. Positions are not compared: a live run's ticks have their own jitter.
"""

from __future__ import annotations

import pytest

from tests.replay.own_logs import DATA, Log, Retelling

LOGS = {"loiter-mavsdk": "sdk", "guard-stop-mavsdk": "sdk", "lora-plan-mavsdk": "radio"}
"""Log -> endpoint."""


def is_within(short, long):
    """Whether ``short`` is ``long`` with pieces left out (the log keeps few heartbeats)."""
    rest = iter(long)
    return all(item in rest for item in short)


def once(answers):
    return {name: list(dict.fromkeys(items)) for name, items in answers.items()}


@pytest.mark.parametrize("name", sorted(LOGS))
def test_the_ground_stations_half_brings_the_vessels_half(name):
    log = Log(DATA / f"{name}.tlog")
    vessel = Retelling(log, LOGS[name]).run()
    if LOGS[name] == "radio":
        # On a slow link both sides repeat what was not answered in time; how often is a matter of milliseconds.
        assert once(vessel.answers()) == once(log.vessel.answers())
    else:
        assert vessel.answers() == log.vessel.answers()
    assert is_within(log.vessel.modes(), vessel.modes())
    assert sorted(set(vessel.texts())) == sorted(set(log.vessel.texts()))


def test_there_is_a_log_of_a_loiter_of_a_guard_stop_and_of_a_plan_over_the_radio():
    assert set(LOGS) <= {path.stem for path in DATA.glob("*.tlog")}
