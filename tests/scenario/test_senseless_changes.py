"""A parameter that is set under way to what no file may hold: refused with the reason, and the boat sails on."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.requests import Result, SetParameter

NO_DEPTH = "depth.enabled=false"
SEED = (NO_DEPTH, "steering.profile=seed")


@pytest.mark.parametrize(
    ("overrides", "name", "value", "said"),
    [
        (SEED, "SEED_HDG_P", 0.0, "SEED_HDG_P = 0: must be at least 0.03"),
        (SEED, "SEED_HDG_P", 0.001, "SEED_HDG_P = 0.001: must be at least 0.03"),
        (SEED, "SEED_HDG_I", 1000.0, "SEED_HDG_I = 1000: more than kp 1.8 in a second"),
        (SEED, "SEED_SPD_P", 0.0, "SEED_SPD_P = 0: must be above 0"),
        (SEED, "SEED_THR_MAX", 0.0, "SEED_THR_MAX = 0: the vessel could never go ahead"),
        ((NO_DEPTH,), "ACT_UPPER", 1500.0, "ACT_UPPER = 1500: actuators.board.thruster_port: its"),
        ((NO_DEPTH,), "ACT_LOWER", 1500.0, "ACT_LOWER = 1500: actuators.board."),
        ((NO_DEPTH,), "GATE_THR_MAX", 0.0, "GATE_THR_MAX = 0: the vessel could never go ahead"),
        ((NO_DEPTH,), "CRUISE_SPEED", 20.0, "CRUISE_SPEED = 20: more than the hull's top speed; at most 3."),
    ],
)
def test_it_is_refused_with_the_key_the_value_and_the_mend(voyage, overrides, name, value, said):
    trip = voyage(*overrides)
    trip.sail(1.5, (20.0, 0.0), (20.0, 60.0), after_s=10.0)
    before = trip.world.app.settings
    reply = trip.ask(SetParameter(name, value))
    assert reply.result is Result.DENIED
    assert reply.reason.startswith(said)
    assert trip.world.app.settings == before
    trip.until(lambda: math.dist((trip.truth.north_m, trip.truth.east_m), (20.0, 40.0)) < 3.0, 90.0)


@pytest.mark.parametrize(
    ("overrides", "name", "value"),
    [
        (SEED, "SEED_HDG_P", 0.04),
        (SEED, "SEED_HDG_I", 0.2),
        (SEED, "SEED_SPD_I", 0.0),
        ((NO_DEPTH,), "ACT_UPPER", 1800.0),
        ((NO_DEPTH,), "GATE_THR_MAX", 0.8),
        ((NO_DEPTH,), "CRUISE_SPEED", 0.5),
        ((NO_DEPTH,), "FS_GCS_ACTION", 4.0),
    ],
)
def test_what_a_file_may_hold_is_taken(voyage, overrides, name, value):
    trip = voyage(*overrides)
    assert trip.ask(SetParameter(name, value)).reason == ""


def test_what_it_makes_wrong_of_another_key_is_told_and_the_second_change_mends_it(voyage):
    trip = voyage(*SEED)
    assert trip.ask(SetParameter("SEED_HDG_I", 1.0)).reason == ""
    assert trip.ask(SetParameter("SEED_HDG_P", 0.5)).reason == ""
    said = [text for text in trip.texts if "is set, but" in text]
    assert said == [
        "SEED_HDG_P is set, but steering.seed.heading_gains.ki = 1: more than kp 0.5 in a second, "
        "and the boat swings or circles; at most 0.5"
    ]
    assert trip.ask(SetParameter("SEED_HDG_I", 0.1)).reason == ""
    assert sum("is set, but" in text for text in trip.texts) == 1


def test_the_least_heading_gain_that_is_taken_still_turns_her(voyage):
    trip = voyage(*SEED, "world.water.wind_mps=5")
    trip.sail(1.0, (10.0, 0.0), (10.0, 150.0))
    for name, value in (("SEED_HDG_P", 0.033), ("SEED_HDG_I", 0.0), ("SEED_HDG_D", 0.0)):
        assert trip.ask(SetParameter(name, value)).reason == ""
    trip.until(lambda: trip.truth.east_m > 20.0, 200.0)
