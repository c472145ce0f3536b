"""Monitors: each flag after its time, and not for what is normal."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.monitors import MonitorConfig, MonitorFlags, Monitors
from mavlink_bridge.language.messages import ActuatorOutput, Desired, EstimatedState, SupplyVoltage

TICK_US = 50_000


class Watch:
    def __init__(self, **config) -> None:
        self.monitors = Monitors(MonitorConfig(**config), math.radians(30.0), TICK_US)
        self.now_us = 0
        self.flags = MonitorFlags()

    def step(self, seconds=0.05, *, thrust=0.0, rudder=0.0, sog=0.0, desired=None, late_s=0.0, supply=None, **more):
        for _ in range(max(1, round(seconds / 0.05))):
            self.now_us += more.get("gap_us", TICK_US)
            state = EstimatedState(self.now_us, x_m=more.get("north", 0.0), y_m=0.0, sog_mps=sog)
            output = ActuatorOutput(self.now_us, thrust, thrust, rudder, rudder, "demand")
            self.flags = self.monitors.step(
                self.now_us,
                state,
                output,
                desired,
                more.get("stopped", False),
                late_s,
                supply,
                lambda share: 3.0 * share,
                more.get("leapt_m", (0.0, 0.0)),
            )
        return self.flags


def test_row_63_thrust_without_speed():
    watch = Watch()
    assert not watch.step(9.95, thrust=0.3, sog=0.22).stuck
    assert watch.step(0.1, thrust=0.3, sog=0.22).stuck
    assert not watch.step(0.05, thrust=0.3, sog=0.23).stuck, "a quarter of what the thrust should give is enough"
    assert not watch.step(20.0, thrust=1.0, sog=0.31).stuck, "slow against a stream, but making way"
    assert watch.step(20.0, thrust=1.0, sog=0.29).stuck
    assert not watch.step(20.0, thrust=0.5, sog=None).stuck, "unknown is not stuck"
    assert not watch.step(20.0, thrust=-0.5, sog=0.0).stuck
    keeping_station = Desired(0.0, 0.1)
    assert not watch.step(20.0, thrust=0.5, sog=0.0, desired=keeping_station).stuck, "stemming the stream is no fault"
    assert watch.step(20.0, thrust=0.5, sog=0.0, desired=Desired(0.0, 1.0)).stuck
    stemming = Desired(0.0, 0.1, asked_mps=1.5)
    assert not watch.step(20.0, thrust=1.0, sog=0.21, desired=stemming).stuck, "against the stream it creeps on"
    assert watch.step(20.0, thrust=1.0, sog=0.19, desired=stemming).stuck, (
        "dead thrust looks like a stream as fast as the vessel"
    )
    assert not Watch(stuck_s=0.0).step(20.0, thrust=0.5, sog=0.0).stuck


def test_row_63_speed_without_thrust():
    watch = Watch()
    assert not watch.step(9.95, sog=0.31).moving_in_neutral
    assert watch.step(0.1, sog=0.31).moving_in_neutral
    assert not watch.step(20.0, sog=0.14).moving_in_neutral
    assert not watch.step(20.0, sog=0.3).moving_in_neutral
    assert not watch.step(20.0, thrust=0.1, sog=2.0).moving_in_neutral


def test_a_drift_that_wavers_about_the_bound_is_told_of_once():
    watch = Watch()
    watch.step(10.05, sog=0.35)
    for _ in range(10):
        assert watch.step(8.0, sog=0.2).moving_in_neutral
        assert watch.step(8.0, sog=0.14).moving_in_neutral
    assert watch.step(20.0, sog=None).moving_in_neutral, "unknown is neither moving nor still"
    assert watch.step(9.95, sog=0.14).moving_in_neutral
    assert not watch.step(0.1, sog=0.14).moving_in_neutral
    watch.step(10.05, sog=0.35)
    assert not watch.step(thrust=0.1, sog=0.35).moving_in_neutral, "it is no longer in neutral"


def test_drift_while_stopped():
    watch = Watch()
    watch.step(north=0.0, stopped=True)
    assert not watch.step(north=5.0, stopped=True).drifting_while_stopped
    assert watch.step(north=5.1, stopped=True).drifting_while_stopped
    assert not watch.step(north=5.1, stopped=False).drifting_while_stopped
    assert not watch.step(north=9.0, stopped=True).drifting_while_stopped, "a new stop, a new anchor"
    assert not watch.step(north=None, stopped=True).drifting_while_stopped


def test_a_boat_at_rest_whose_receiver_wanders_is_told_of_one_drift_and_one_that_drifts_at_each_doubling():
    """Told 20 times in three minutes in a dead calm; and one that drifted 80 m was told of the first five."""
    watch, told = Watch(), []
    watch.step(north=0.0, stopped=True)
    for north in (5.2, 4.6, 5.3, 2.6, 5.1, None, 4.9, 10.1, 9.0, 12.0, 36.0, 54.0, 80.5):
        before = watch.flags
        assert watch.step(north=north, stopped=True).drifting_while_stopped
        told += [text for _, text in watch.flags.told_since(before)]
    assert told == [f"Drifted {far_m} m since the failsafe's stop" for far_m in (10, 20, 40, 80)]
    assert not watch.step(north=2.4, stopped=True).drifting_while_stopped


def test_a_position_that_leaps_is_no_drift():
    watch = Watch()
    watch.step(north=0.0, stopped=True)
    watch.step(north=3.0, stopped=True)
    assert not watch.step(north=103.0, stopped=True, leapt_m=(100.0, 0.0)).drifting_while_stopped
    assert watch.step(north=105.1, stopped=True, leapt_m=(100.0, 0.0)).drifting_while_stopped
    assert watch.step(north=3.0, stopped=True, leapt_m=(100.0, 0.0)).drifting_while_stopped


def test_row_59_oscillation():
    """Five reversals beyond half output within two seconds; three is the default, which sees slower hulls too."""
    watch = Watch(oscillation_hold_s=0.0)
    seen = [watch.step(0.55, thrust=0.6 * (-1) ** i, sog=2.0).oscillating for i in range(7)]
    assert seen == [False] * 5 + [True, True]
    assert not watch.step(3.05, thrust=0.0, sog=2.0).oscillating
    for i in range(12):
        assert not watch.step(0.8, thrust=0.9 * (-1) ** i, sog=2.0).oscillating, "slower than that"
    watch = Watch(oscillation_window_s=2.0, oscillation_hold_s=0.0)
    seen = [watch.step(0.25, thrust=0.6 * (-1) ** i, sog=2.0).oscillating for i in range(7)]
    assert seen == [False] * 5 + [True, True]
    assert not watch.step(2.05, thrust=0.0, sog=2.0).oscillating
    for i in range(12):
        assert not watch.step(0.25, thrust=0.5 * (-1) ** i, sog=2.0).oscillating, "half output is allowed"
    for i in range(12):
        assert not watch.step(0.5, thrust=0.9 * (-1) ** i, sog=2.0).oscillating, "slower than that too"
    rudder = math.radians(16.0)
    assert [watch.step(0.25, rudder=rudder * (-1) ** i, sog=2.0).oscillating for i in range(7)][-1]


def _swung(watch):
    """Swing until the thrust is cut."""
    while not watch.step(0.25, thrust=0.9 * watch.side, sog=2.0).oscillating:
        watch.side = -watch.side


def _cut_s(watch):
    """How long it stays cut from now on with the thrusters at rest, s."""
    began_us = watch.now_us
    while watch.step(0.25, thrust=0.0, sog=2.0).oscillating:
        pass
    return (watch.now_us - began_us) / 1e6


def test_row_59_thrust_comes_back_by_itself_and_later_each_time():
    """A sound loop in a blow that was cut until an operator came was carried away; an unstable one swings again at once."""
    watch = Watch()
    watch.side = 1
    cut = []
    for _ in range(6):
        _swung(watch)
        cut.append(_cut_s(watch))
    assert cut == pytest.approx([15.0, 30.0, 60.0, 120.0, 120.0, 120.0], abs=3.5)
    for _ in range(620):
        watch.step(1.0, thrust=0.0, sog=2.0)
    _swung(watch)
    assert _cut_s(watch) == pytest.approx(15.0, abs=3.5), "ten quiet minutes later it is the first"


def test_row_62_battery_levels_filtered_and_the_sensor_lost():
    watch = Watch(battery_low_v=12.0, battery_critical_v=11.0, battery_empty_v=10.0)
    assert watch.step() == MonitorFlags()

    def feed(volts, seconds):
        for _ in range(round(seconds / 0.05)):
            watch.step(supply=SupplyVoltage(watch.now_us, volts))
        return watch.flags

    assert not feed(12.5, 1.0).battery_low
    assert not feed(9.0, 0.5).battery_low, "a dip at full thrust is filtered"
    assert feed(11.5, 60.0).battery_low
    assert not watch.flags.battery_critical
    assert feed(10.5, 60.0).battery_critical
    assert not watch.flags.battery_empty
    assert feed(9.5, 60.0).battery_empty
    assert not watch.flags.battery_lost
    old = SupplyVoltage(watch.now_us, 9.5)
    watch.step(4.9, supply=old)
    assert not watch.flags.battery_lost
    assert watch.step(0.2, supply=old).battery_lost
    assert watch.step(supply=None).battery_lost
    assert watch.step(supply=SupplyVoltage(watch.now_us, math.nan)).battery_lost
    assert Watch().step(5.0, supply=SupplyVoltage(0, 1.0)) == MonitorFlags(), "no level set, nothing judged"


def test_row_03_row_35_ticks():
    watch = Watch()
    assert not watch.step(late_s=0.2).tick_late
    assert watch.step(late_s=0.201).tick_late
    assert not watch.flags.tick_very_late
    assert watch.step(late_s=0.501).tick_very_late
    assert not watch.step(gap_us=1_000_000).time_jump
    assert watch.step(gap_us=1_000_001).time_jump
    assert watch.step(gap_us=-1).time_jump
    assert not watch.step().time_jump


def test_overruns_are_more_than_five_in_a_hundred_ticks():
    watch = Watch()
    for _ in range(10):
        watch.step(late_s=0.051)
        assert not watch.flags.overruns
        watch.step(0.45)
    assert watch.step(late_s=0.051).overruns
    assert not watch.step(10.0).overruns
    for _ in range(40):
        assert not watch.step(late_s=0.05).overruns


def test_new_thresholds_at_once():
    watch = Watch()
    watch.step(5.0, sog=0.5)
    watch.monitors.configure(MonitorConfig(drift_s=4.0))
    assert watch.step(sog=0.5).moving_in_neutral


@pytest.mark.parametrize("field", ["stuck", "oscillating", "battery_lost", "time_jump", "overruns"])
def test_all_is_well_at_first(field):
    assert getattr(Watch().step(), field) is False
