"""The minimum-altitude guard: the seed's sequences, the unknown state, aborts, policies and texts."""

from __future__ import annotations

import math

import pytest

from companion.core.guard.depth.config import DepthGuardConfig
from companion.core.guard.depth.grid import DepthGrid, PlanLeg, PlanProblem, Sounding, build, offset
from companion.core.guard.depth.guard import DepthFlags, DepthGuard, GuardOutput, next_state
from companion.core.guard.depth.input import DepthInputConfig
from companion.core.guard.depth.memory import DepthMemoryConfig
from companion.core.hull.geometry import HullGeometry
from companion.core.hull.stopping import Braking as ThrustAstern
from mavlink_bridge.language.geodesy import metres_per_radian
from mavlink_bridge.language.messages import Distance, EstimatedState, GuardState, Severity
from mavlink_bridge.language.points import NorthEast
from sitl.plant.library import load_vessel
from tools.benches.cells.drawn_hulls import drawn

UNKNOWN, OK, CORRECTION, LOCKED = GuardState.UNKNOWN, GuardState.OK, GuardState.CORRECTION, GuardState.LOCKED
HULL = HullGeometry(beam_m=1.1)
OTTER = HullGeometry(keel_m=0.35, transducer_m=0.2, beam_m=1.08)
RAW = DepthInputConfig(median_samples=1, jump_rate_mps=50.0, stale_s=1.0)
"""Every reading is the altitude: the seed had no chain."""
SEED = DepthGuardConfig(input=RAW, rate_look_ahead=False, map_look_ahead=False, unknown_policy="ignore")
STEP_US = 500_000


class Run:
    """Feeds altitudes half a second apart to a guard."""

    def __init__(self, config: DepthGuardConfig = SEED, active: bool = True) -> None:
        self.guard = DepthGuard(config, HULL)
        self.active = active
        self.now_us = 0
        self.texts: list[tuple[Severity, str]] = []

    def feed(self, altitude_m: float | None, state: EstimatedState | None = None) -> GuardOutput:
        self.now_us += STEP_US
        if altitude_m is not None:
            self.guard.measure(Distance(self.now_us, altitude_m), state)
        return self.tick()

    def tick(self, after_us: int = 0) -> GuardOutput:
        self.now_us += after_us
        out = self.guard.step(self.now_us, None, self.active)
        self.texts += out.texts
        return out

    def seen(self, *altitudes_m: float) -> list[tuple[GuardState, bool]]:
        return [(out.state, out.abort) for out in map(self.feed, altitudes_m)]


def test_seed_sequence_1_into_correction_then_locked():
    assert Run().seen(5.0, 3.95, 3.5) == [(OK, False), (CORRECTION, True), (LOCKED, True)]


def test_seed_sequence_2_straight_into_locked():
    assert Run().seen(5.0, 2.0) == [(OK, False), (LOCKED, True)]


def test_seed_sequence_3_locked_at_the_first_reading():
    run = Run()
    assert run.seen(2.0) == [(LOCKED, True)]
    run = Run(active=False)
    assert run.seen(2.0) == [(LOCKED, False)], "no loop is active: tracked, not aborted"
    assert run.guard.activation(run.now_us) == "depth guard locked: altitude 2.00 m, needs 4.10 m"
    assert run.tick().abort, "one Abort for the forbidden activation"
    assert not run.tick().abort


def test_seed_sequence_4_a_correction_that_succeeds():
    assert Run().seen(5.0, 3.95, 4.05, 4.2) == [(OK, False), (CORRECTION, True), (CORRECTION, False), (OK, False)]


def test_seed_integration_turning_back_returns_to_normal():
    """The seed lists this result under the other scenario; the two were swapped."""
    run = Run()
    run.seen(5.0, 3.95)
    run.active = False  # the abort ends the manoeuvre ...
    assert run.guard.activation(run.now_us) is None, "... and an order to turn back is accepted"
    run.active = True
    assert run.seen(3.92, 3.98, 4.05, 4.3)[-1] == (OK, False)
    assert run.guard.refusal(run.now_us) is None


def test_seed_integration_pressing_on_ends_locked_without_correction():
    run = Run()
    run.seen(5.0, 3.95)
    assert run.seen(3.93, 3.85) == [(CORRECTION, False), (LOCKED, True)]
    assert run.guard.activation(run.now_us) is not None
    assert run.seen(3.85, 4.05)[-1][0] is LOCKED, "4.05 is not good yet"
    assert run.seen(4.1)[-1] == (OK, False)
    assert run.guard.activation(run.now_us) is None


def test_each_entry_aborts_once_and_no_more():
    run = Run()
    seen = run.seen(5.0, 3.95, 3.94, 3.95, 3.5, 3.4, 3.95, 4.2, 3.95)
    assert [abort for _, abort in seen] == [False, True, False, False, True, False, False, False, True]


@pytest.mark.parametrize(
    ("state", "expected"),
    [
        # altitude:   None      4.1  4.0         3.9         3.8999
        (UNKNOWN, (UNKNOWN, OK, CORRECTION, CORRECTION, LOCKED)),
        (OK, (UNKNOWN, OK, OK, CORRECTION, LOCKED)),
        (CORRECTION, (UNKNOWN, OK, CORRECTION, CORRECTION, LOCKED)),
        (LOCKED, (LOCKED, OK, LOCKED, LOCKED, LOCKED)),
    ],
)
def test_the_table_with_unknown(state, expected):
    altitudes = (None, 4.1, 4.0, 3.9, 3.8999)
    assert tuple(next_state(state, altitude, 4.0, 0.1, 0.1) for altitude in altitudes) == expected


def test_equality_in_decimal_numbers():
    assert next_state(OK, 4.0, 4.0, 0.1, 0.1) is OK
    assert next_state(OK, 4.0 - 1e-8, 4.0, 0.1, 0.1) is CORRECTION
    assert next_state(OK, 0.3 - 0.1, 0.3, 0.1, 0.1) is CORRECTION, "0.3 - 0.1 is not below 0.2"
    assert next_state(LOCKED, 0.3, 0.1 + 0.1, 0.1, 0.1) is OK, "0.30000000000000004 is reached by 0.3"
    assert next_state(OK, 4.0 - 5e-10, 4.0, 0.1, 0.1) is OK
    assert next_state(CORRECTION, 3.9 - 5e-10, 4.0, 0.1, 0.1) is CORRECTION
    assert next_state(CORRECTION, 3.9 - 5e-9, 4.0, 0.1, 0.1) is LOCKED
    assert next_state(CORRECTION, 4.1 - 5e-10, 4.0, 0.1, 0.1) is OK
    assert next_state(CORRECTION, 4.1 - 5e-9, 4.0, 0.1, 0.1) is CORRECTION


def test_a_parameter_change_is_judged_at_once():
    run = Run()
    run.feed(5.0)
    run.guard.configure(SEED.model_copy(update={"min_altitude_m": 5.05}))
    out = run.tick()
    assert (out.state, out.abort, out.limit_m) == (CORRECTION, True, 5.05)
    run.guard.configure(SEED)
    assert run.tick().state is OK


def test_unknown_after_correction_keeps_the_stop():
    run = Run(SEED.model_copy(update={"unknown_policy": "warn"}))
    run.seen(5.0, 3.95)
    out = run.tick(after_us=2_000_000)
    assert (out.state, out.flags.depth_shallow, out.altitude_m) == (UNKNOWN, True, None)
    assert run.feed(4.2).flags.depth_shallow is False


def test_unknown_to_the_band_above_the_limit_needs_no_abort():
    run = Run()
    out = run.feed(4.05)
    assert (out.state, out.abort, out.flags.depth_shallow) == (CORRECTION, False, False)
    out = run.feed(3.95)
    assert (out.state, out.abort, out.flags.depth_shallow) == (CORRECTION, True, True), (
        "below the limit it is an entry after all"
    )
    assert run.feed(3.94).abort is False
    run = Run()
    assert run.feed(4.0 - 1e-10).abort is False
    run = Run()
    assert run.feed(3.99).abort is True


def test_locked_outlasts_a_silent_sounder_and_is_a_flag_of_its_own():
    run = Run()
    out = run.feed(2.0)
    assert (out.flags.depth_locked, out.flags.depth_shallow) == (True, False)
    out = run.tick(after_us=60_000_000)
    assert (out.state, out.flags.depth_locked) == (LOCKED, True)
    assert run.guard.refusal(run.now_us) == "depth guard locked: altitude unknown, needs 4.10 m"
    assert run.feed(4.1).flags.depth_locked is False


def test_correction_that_locks_is_no_longer_shallow():
    run = Run()
    assert run.feed(3.95).flags.depth_shallow
    assert not run.feed(3.0).flags.depth_shallow


def test_unlock_once_lasts_until_the_water_is_good():
    run = Run()
    run.feed(3.0)
    run.guard.unlock_once()
    assert run.guard.refusal(run.now_us) is None
    out = run.feed(3.2)
    assert (out.state, out.flags.depth_locked, out.abort) == (LOCKED, False, False)
    run.seen(5.0, 3.0)
    assert run.guard.refusal(run.now_us) is not None


def test_an_unlock_is_used_up_by_the_next_lock():
    run = Run()
    run.feed(5.0)
    run.guard.unlock_once()
    assert run.feed(3.0).flags.depth_locked


def test_asking_for_the_refusal_changes_nothing():
    run = Run(active=False)
    run.feed(2.0)
    assert run.guard.refusal(run.now_us) is not None
    assert not run.tick().abort


def test_disabled_the_guard_only_measures():
    run = Run(SEED.model_copy(update={"enabled": False, "required": True}))
    assert run.guard.activation(0) is None
    out = run.feed(2.0)
    assert (out.state, out.altitude_m, out.altitude_raw_m, out.limit_m) == (UNKNOWN, 2.0, 2.0, None)
    assert (out.abort, out.flags.depth_locked, out.flags.depth_shallow, out.flags.depth_blind) == (
        False,
        False,
        False,
        False,
    )
    assert run.guard.activation(run.now_us) is None
    run.guard.configure(SEED)
    assert run.tick().state is LOCKED
    run.guard.configure(SEED.model_copy(update={"enabled": False}))
    run.tick()
    run.guard.configure(SEED)
    assert run.tick().abort, "switched on again it enters anew"


def test_switching_off_forgets_the_correction():
    run = Run()
    run.feed(3.95)
    run.guard.configure(SEED.model_copy(update={"enabled": False}))
    run.tick()
    run.guard.configure(SEED)
    assert run.feed(4.05).flags.depth_shallow is False


def test_margins_of_zero_leave_no_dead_state():
    config = SEED.model_copy(update={"minimum_margin_m": 0.0, "good_margin_m": 0.0})
    assert Run(config).seen(5.0, 4.0, 3.999, 4.0) == [(OK, False), (OK, False), (LOCKED, True), (OK, False)]


# ---- texts


def test_each_transition_is_told_with_altitude_and_limit():
    run = Run(SEED.model_copy(update={"unknown_policy": "warn"}))
    run.seen(5.0, 3.95, 3.5, 4.2)
    run.tick(after_us=2_000_000)
    assert run.texts == [
        (Severity.INFO, "Depth 5.00 m, limit 4.00 m: good"),
        (Severity.WARNING, "Depth 3.95 m, limit 4.00 m: correction manoeuvre allowed"),
        (Severity.CRITICAL, "Depth 3.50 m, limit 4.00 m: locked, no manoeuvre"),
        (Severity.INFO, "Depth 4.20 m, limit 4.00 m: good"),
        (Severity.WARNING, "Depth unknown (limit 4.00 m)"),
    ]


def test_the_startup_warning_says_what_the_margins_allow():
    """vessel-control §5.4, with its closed form for the stopping distance of the default vessel."""
    text = DepthGuard(DepthGuardConfig(), HULL).startup_warning(lambda u: 85.5 / 17.0 * math.log1p(17.0 * u / 25.0))
    assert text == "Depth margin 0.1 m: correction only on slopes below 2.3 % at 1.5 m/s, 1.6 % at 2.5 m/s"


# ---- altitude unknown


@pytest.mark.parametrize(
    ("policy", "required", "lost", "slow", "blind"),
    [
        ("ignore", False, False, None, False),
        ("warn", False, True, None, False),
        ("slow", False, True, 0.5, False),
        ("stop", False, True, None, True),
        ("ignore", True, True, None, True),
    ],
)
def test_policies_for_an_unknown_altitude(policy, required, lost, slow, blind):
    run = Run(SEED.model_copy(update={"unknown_policy": policy, "required": required}))
    for _ in range(7):
        run.feed(5.0)
    assert not run.tick().flags.depth_lost
    out = run.tick(after_us=1_000_001)
    assert (out.flags.depth_lost, out.slow_to_mps, out.flags.depth_blind) == (lost, slow, False)
    assert run.tick(after_us=3_999_998).flags.depth_blind is False
    assert run.tick(after_us=1).flags.depth_blind is blind


def test_never_heard_counts_from_the_start():
    run = Run(SEED.model_copy(update={"unknown_policy": "stop"}))
    run.now_us = 70_000_000
    assert not run.tick().flags.depth_lost
    assert not run.tick(after_us=2_999_999).flags.depth_lost, "a sounder may take three seconds to speak"
    assert run.tick(after_us=1).flags.depth_lost
    assert not run.tick(after_us=1_999_999).flags.depth_blind
    assert run.tick(after_us=1).flags.depth_blind


def test_the_first_seconds_are_not_called_lost():
    run = Run(DepthGuardConfig(unknown_policy="warn"))
    for i in range(12):
        out = run.tick(after_us=50_000) if i < 6 else run.feed(5.0)
        assert not out.flags.depth_lost, "the filter fills"
    assert out.state is OK


def test_required_depth_refuses_activation():
    run = Run(SEED.model_copy(update={"required": True}))
    assert run.guard.activation(0) == "water depth unknown, and depth.required is set"
    run.feed(5.0)
    assert run.guard.refusal(run.now_us) is None


def test_losing_the_bottom_in_deep_water_is_normal_and_at_five_metres_is_not():
    config = SEED.model_copy(
        update={"unknown_policy": "stop", "input": RAW.model_copy(update={"range_max_m": 50.0, "jump_rate_mps": 50.0})}
    )
    run = Run(config)
    run.feed(45.0)
    out = run.tick(after_us=20_000_000)
    assert (out.flags.depth_lost, out.flags.depth_blind) == (False, False)
    run = Run(config)
    run.feed(5.0)
    out = run.tick(after_us=20_000_000)
    assert (out.flags.depth_lost, out.flags.depth_blind) == (True, True)
    run = Run(config.model_copy(update={"required": True}))
    run.feed(45.0)
    assert run.tick(after_us=20_000_000).flags.depth_blind, "required is required"


def test_a_drop_out_at_five_metres_while_closing_is_acted_on_within_a_second():
    """Must hold of the issue: the policy slow acts as soon as the reading is stale, 1 s."""
    run = Run(DepthGuardConfig(unknown_policy="slow", input=RAW))
    for altitude in (8.0, 7.5, 7.0, 6.5, 6.0, 5.5, 5.0):
        run.feed(altitude)
    last_us = run.now_us
    while not (out := run.tick(after_us=50_000)).flags.depth_lost:
        pass
    assert (run.now_us - last_us) / 1e6 <= 1.05
    assert out.slow_to_mps == 0.5


BRAKING = SEED.model_copy(update={"brake": True})
ASTERN = ThrustAstern(load_vessel("otter"))
"""Of the Otter: from 2 m/s it may take 1.7 s, and is let go at 0.12 m/s, which its propellers take off running down."""


class Braking(Run):
    astern = ASTERN

    def at_speed(
        self, altitude_m: float | None, speed_mps: float, after_us: int = 100_000, active: bool = True
    ) -> GuardOutput:
        self.now_us += after_us
        state = EstimatedState(self.now_us, sog_mps=speed_mps)
        if altitude_m is not None:
            self.guard.measure(Distance(self.now_us, altitude_m), state)
        return self.guard.step(self.now_us, state, active, braking=self.astern)


def test_the_brake_takes_the_way_off_and_then_the_stop_follows():
    run = Braking(BRAKING)
    assert not run.at_speed(5.0, 2.0).flags.depth_braking
    out = run.at_speed(3.0, 2.0)
    assert (out.abort, out.flags.depth_braking, out.flags.depth_locked, out.flags.depth_shallow) == (
        True,
        True,
        False,
        False,
    )
    out = run.at_speed(3.0, 0.2)
    assert (out.abort, out.flags.depth_braking, out.flags.depth_locked) == (False, True, False)
    out = run.at_speed(3.0, 0.11)
    assert (out.flags.depth_braking, out.flags.depth_locked) == (False, True)
    assert not run.at_speed(3.0, 2.0).flags.depth_braking, "no second time: the entry is over"
    run = Braking(BRAKING)
    run.at_speed(5.0, 2.0)
    out = run.at_speed(3.95, 2.0)
    assert (out.flags.depth_braking, out.flags.depth_shallow) == (True, False)
    assert run.at_speed(3.95, 0.1).flags.depth_shallow


@pytest.mark.parametrize("vessel", [load_vessel("otter"), drawn("heavy", 5)], ids=["otter", "heavy"])
def test_the_brake_lasts_as_long_as_the_hull_may_need_and_rests_for_five_seconds(vessel):
    """A heavy boat was let go after three seconds, with most of her way still on."""
    run = Braking(BRAKING)
    run.astern = ThrustAstern(vessel)
    may_need_us = round(run.astern.lasts_s(2.0) * 1e6)
    run.at_speed(5.0, 2.0)
    assert run.at_speed(3.95, 2.0).flags.depth_braking
    assert run.at_speed(3.95, 2.0, may_need_us - 1).flags.depth_braking
    assert not run.at_speed(3.95, 2.0, 1).flags.depth_braking
    run.at_speed(4.2, 2.0, 1_000_000)
    assert not run.at_speed(3.95, 2.0, 3_999_999).flags.depth_braking
    run.at_speed(4.2, 2.0, 1)
    assert run.at_speed(3.95, 2.0, 1).flags.depth_braking


def test_no_brake_when_off_inactive_or_without_way():
    for config, speed, active in ((SEED, 2.0, True), (BRAKING, 2.0, False), (BRAKING, 0.11, True)):
        run = Braking(config)
        run.at_speed(5.0, speed, active=active)
        assert not run.at_speed(3.0, speed, active=active).flags.depth_braking
    run = Braking(BRAKING)
    run.at_speed(5.0, 2.0)
    assert run.at_speed(3.0, 2.0).flags.depth_braking
    assert not run.at_speed(3.0, 2.0, active=False).flags.depth_braking
    assert not run.at_speed(3.0, 2.0).flags.depth_braking, "armed again it does not go on"
    run = Run(BRAKING)
    run.feed(5.0)
    out = run.feed(3.0)
    assert (out.abort, out.flags.depth_braking, out.flags.depth_locked) == (True, False, True), (
        "at an unknown speed it stops without"
    )


def test_a_gate_that_lets_nothing_astern_through_leaves_the_brake_out():
    run = Braking(BRAKING)
    run.astern = ThrustAstern(load_vessel("otter"), least=0.0)
    run.at_speed(5.0, 2.0)
    out = run.at_speed(3.0, 2.0)
    assert (out.abort, out.flags.depth_braking, out.flags.depth_locked) == (True, False, True)


def test_a_vessel_that_is_set_sideways_is_not_pushed_astern():
    run = Braking(BRAKING)
    run.at_speed(5.0, 2.0)
    assert run.at_speed(3.0, 2.0).flags.depth_braking
    set_by = EstimatedState(run.now_us, sog_mps=0.4, psi_rad=math.pi / 2.0, vx_mps=-0.4, vy_mps=0.1)
    assert not run.guard.step(run.now_us + 50_000, set_by, True, braking=ASTERN).flags.depth_braking


def test_while_the_brake_rests_the_guard_reckons_with_coasting():
    """On a slope: what stopping needs hangs on whether the brake would be used."""
    run = Braking(DepthGuardConfig(input=RAW, brake=True, map_look_ahead=False, min_altitude_m=4.0))
    limits_m = []
    for tick in range(160):
        now_us, altitude_m = tick * 100_000, 18.0 - 0.1 * tick
        state = EstimatedState(now_us, sog_mps=2.0)
        run.guard.measure(Distance(now_us, altitude_m), state)
        out = run.guard.step(now_us, state, True, None, coasting, braking=ASTERN)
        limits_m.append((out.flags.depth_braking, out.limit_m))
    begins = [brakes for brakes, _ in limits_m].index(True)
    by_brake, by_coasting = limits_m[begins][1], limits_m[begins + 30][1]
    assert by_brake == pytest.approx(4.0 + 0.5 * ASTERN.way_m(2.0) + 0.6, abs=0.1)
    assert by_coasting == pytest.approx(4.0 + 0.5 * coasting(2.0) + 0.6, abs=0.1)


def coasting(speed_mps: float) -> float:
    return ThrustAstern(load_vessel("otter"), least=0.0).way_m(speed_mps)


def test_the_first_tick_can_brake():
    run = Braking(BRAKING)
    assert run.at_speed(3.0, 2.0, after_us=0).flags.depth_braking


def test_soon_after_setting_off_it_brakes_as_well():
    run = Braking(BRAKING)
    for _ in range(20):
        run.at_speed(5.0, 0.0)
    run.at_speed(5.0, 1.0)
    assert run.at_speed(3.0, 1.0).flags.depth_braking


def test_a_stop_by_the_map_brakes_too():
    guard = DepthGuard(DepthGuardConfig(input=RAW, brake=True), HULL)
    guard.set_map(chart(3.0, 60.0))
    out = guard.step(0, at(54.0, 2.0), True, None, stopping, braking=ASTERN)
    assert (out.flags.depth_braking, out.flags.depth_ahead) == (True, False)
    out = guard.step(1_000_000, at(55.0, 0.1), True, None, stopping, braking=ASTERN)
    assert out.flags.depth_braking is False


# ---- look-ahead and map, as far as the guard itself decides

ORIGIN = (0.7188, -0.1519)


def at(north_m: float, speed_mps: float, now_us: int = 0) -> EstimatedState:
    return EstimatedState(
        now_us,
        lat_rad=ORIGIN[0] + north_m / metres_per_radian(ORIGIN[0])[0],
        lon_rad=ORIGIN[1],
        x_m=north_m,
        y_m=0.0,
        psi_rad=0.0,
        r_radps=0.0,
        sog_mps=speed_mps,
        cog_rad=0.0,
    )


def chart(depth_m: float, north_m: float, deeper_m: float = 30.0) -> DepthGrid:
    """30 m of water everywhere, ``depth_m`` north of ``north_m``."""
    places = [(n, e) for n in range(-40, 120, 4) for e in (-8, -4, 0, 4, 8)]
    return build((Sounding(*offset(*ORIGIN, n, e), depth_m if n >= north_m else deeper_m) for n, e in places), 2.0, 3.0)


def stopping(speed_mps: float) -> float:
    return 2.0 * speed_mps


def test_the_map_stops_before_the_shallow_and_not_otherwise():
    guard = DepthGuard(DepthGuardConfig(input=RAW), HULL)
    guard.set_map(chart(3.0, 60.0))
    out = guard.step(0, at(0.0, 2.0), True, None, stopping)
    assert (out.flags.depth_ahead, out.map_least_m) == (False, 30.0)
    out = guard.step(0, at(52.0, 2.0), True, None, stopping)
    assert (out.flags.depth_ahead, out.map_least_m, out.abort) == (True, 3.0, False)
    assert out.texts[0][1] == "Shallow water ahead (map 3.0 m): stopping"
    assert guard.step(0, at(52.0, 2.0), True, None, stopping).texts == (), "told once"
    assert guard.step(0, at(52.0, 2.0), False, None, stopping).flags.depth_ahead is False
    guard.set_map(None)
    assert guard.step(0, at(52.0, 2.0), True, None, stopping).flags.depth_ahead is False


def test_tide_keel_and_uncertainty_shift_the_map():
    config = DepthGuardConfig(input=RAW, tide_m=1.0, map_sigma_m=0.2)
    guard = DepthGuard(config, HullGeometry(keel_m=0.5, beam_m=1.1))
    guard.set_map(chart(3.0, 60.0))
    assert guard.step(0, at(58.0, 2.0), True, None, stopping).map_least_m == pytest.approx(3.3)
    leg = PlanLeg(7, (ORIGIN, offset(*ORIGIN, 80.0, 0.0)))
    problem = guard.check_plan([leg])
    assert problem == PlanProblem(7, "charted depth 3.0 m, at least 3.7 m needed")


def test_a_plan_is_held_against_the_map_only_when_there_is_one():
    leg = PlanLeg(7, (ORIGIN, offset(*ORIGIN, 80.0, 0.0)))
    guard = DepthGuard(DepthGuardConfig(input=RAW), HULL)
    assert guard.check_plan([leg]) is None
    guard.set_map(chart(3.0, 60.0))
    assert guard.check_plan([leg]) == PlanProblem(7, "charted depth 3.0 m, at least 4.0 m needed")
    guard.set_map(chart(4.0, 60.0))
    assert guard.check_plan([leg]) is None
    guard.set_map(chart(3.0, 60.0))
    guard.configure(DepthGuardConfig(input=RAW, enabled=False))
    assert guard.check_plan([leg]) is None


def falling(guard: DepthGuard, start_m: float, rate_mps: float, seconds: float) -> int:
    """Feed a steadily closing bottom at 10 Hz; return the time of the last reading."""
    now_us = 0
    for i in range(round(seconds * 10)):
        now_us = i * 100_000
        guard.measure(Distance(now_us, start_m - rate_mps * i * 0.1), at(0.0, 2.0))
        guard.step(now_us, at(-40.0 + 0.2 * i, 2.0), False, None, stopping)
    return now_us


def test_the_closing_rate_raises_the_limit_slows_and_stops():
    config = DepthGuardConfig(input=RAW.model_copy(update={"sigma_m": 0.0}))
    guard = DepthGuard(config, HULL)
    now_us = falling(guard, 10.0, 0.5, 8.0)  # now at 6.05 m
    out = guard.step(now_us, at(0.0, 2.0), True, None, stopping)
    # 4 m of way in 2 s of run and 0.6 s of reaction at 0.5 m/s
    # 0.1 m of noise (0.5 % of the altitude) costs the proof a few cm/s.
    assert out.closing_mps == pytest.approx(0.5, abs=0.02)
    assert out.limit_m == pytest.approx(4.0 + out.closing_mps * 2.6, abs=1e-6)
    assert (out.flags.depth_ahead, out.slow_to_mps) == (False, None)
    guard = DepthGuard(config, HULL)
    now_us = falling(guard, 9.6, 0.5, 8.0)  # 5.65 m: a stop would need 1.3 m, one and a half times that is not there
    out = guard.step(now_us, at(0.0, 2.0), True, None, stopping)
    assert out.flags.depth_ahead is False
    assert 1.5 < out.slow_to_mps < 2.0
    guard = DepthGuard(config, HULL)
    now_us = falling(guard, 9.2, 0.5, 8.0)
    out = guard.step(now_us, at(0.0, 2.0), True, None, stopping)
    assert (out.flags.depth_ahead, out.state, out.abort) == (True, OK, False)


def test_unknown_and_closing_ask_for_the_slower_of_both():
    config = DepthGuardConfig(
        input=RAW.model_copy(update={"sigma_m": 0.0}), unknown_policy="slow", unknown_speed_mps=0.7
    )
    guard = DepthGuard(config, HULL)
    now_us = falling(guard, 9.6, 0.5, 8.0)
    out = guard.step(now_us, at(0.0, 2.0), True, None, stopping)
    assert out.slow_to_mps > 1.5
    assert guard.step(now_us + 2_000_000, at(0.0, 2.0), True, None, stopping).slow_to_mps == 0.7


def test_the_chain_takes_new_settings_too():
    run = Run()
    run.guard.configure(SEED.model_copy(update={"input": RAW.model_copy(update={"range_min_m": 2.0})}))
    assert run.feed(1.9).altitude_m is None
    assert run.feed(5.0).altitude_m == 5.0


def test_an_output_says_nothing_it_was_not_told():
    out = GuardOutput(UNKNOWN, None, None, None)
    assert (out.abort, out.neutral, out.flags) == (False, False, DepthFlags())
    assert (out.slow_to_mps, out.map_least_m, out.closing_mps, out.texts) == (None, None, 0.0, ())


@pytest.mark.parametrize(("echo_s", "stops"), [(0.1, False), (3.0, False), (7.0, True)], ids=["one", "fish", "bottom"])
def test_a_false_echo_over_unfathomable_water_does_not_stop_with_the_policy_stop(echo_s, stops):
    """Out in deep water, where losing the bottom is normal; what is heard for long is the bottom, and losing it counts."""
    guard = DepthGuard(DepthGuardConfig(unknown_policy="stop"), HULL)
    state = at(0.0, 2.0)
    now_us, out = 0, None

    def go(seconds, distance_m):
        nonlocal now_us, out
        for _ in range(round(seconds * 10)):
            now_us += 100_000
            if distance_m is not None:
                guard.measure(Distance(now_us, distance_m), state)
            out = guard.step(now_us, state, True, None, lambda speed: 2.3 * speed)

    go(10.0, 95.0)
    go(60.0, None)
    assert not out.flags.depth_lost
    go(echo_s, 30.0)
    go(20.0, None)
    assert out.flags.depth_lost == stops
    assert out.flags.depth_blind == stops
    assert not out.abort


def test_what_is_sounded_is_remembered_below_datum_where_and_when():
    """Altitude 6 m over a keel 0.35 m deep, at 1.5 m of tide: 4.85 m below datum."""
    guard = DepthGuard(DepthGuardConfig(tide_m=1.5), OTTER)
    guard.measure(Distance(0, 6.15), at(0.0, 2.0))
    guard.measure(Distance(100_000, 6.15), None)
    guard.memory.close_cell()
    ((lat, lon, cell),) = guard.memory.known()
    assert (cell.soundings, cell.last_s) == (1, 0)
    assert cell.least_m == pytest.approx(4.85, abs=0.011)
    assert math.hypot((lat - at(0.0, 2.0).lat_rad) * 6.4e6, (lon - at(0.0, 2.0).lon_rad) * 4.8e6) < 2.0
    guard.utc_s = 1_800_000_000
    guard.measure(Distance(200_000, 6.15), at(0.0, 2.0))
    guard.memory.close_cell()
    assert [cell.last_s for *_, cell in guard.memory.known()] == [1_800_000_000]
    off = DepthGuard(DepthGuardConfig(memory=DepthMemoryConfig(enabled=False)), OTTER)
    assert off.memory is None
    off.measure(Distance(0, 6.15), at(0.0, 2.0))


def locked_at(loops_active, config=None, path=None):
    """Down a quiet slope of 0.1 m/s at 10 Hz: the altitude of the reading that locks a correction, and readings waited for in neutral."""
    neutral = 0
    run = Run(config or DepthGuardConfig(input=RAW.model_copy(update={"sigma_m": 0.01})))
    for number in range(300):
        altitude_m = 5.0 - 0.01 * number
        state = at(0.1 * number, 1.0)
        run.guard.measure(Distance(number * 100_000, altitude_m), state)
        out = run.guard.step(number * 100_000, state, loops_active and altitude_m < 3.95, path, stopping)
        neutral += out.neutral
        if out.state is LOCKED:
            return altitude_m, neutral
    raise AssertionError("never")


def test_who_presses_on_is_locked_without_waiting_for_evidence():
    on = NorthEast((100.0, 0.0))
    assert locked_at(True) == (pytest.approx(3.89), 0)
    assert locked_at(True, path=lambda reach_m: (on,)) == (pytest.approx(3.89), 0)
    assert locked_at(False) == (pytest.approx(3.86), 0), "the mean of 0.8 s has come there"


def test_who_turns_back_and_still_closes_waits_for_evidence_in_neutral():
    assert locked_at(True, path=lambda reach_m: (NorthEast((0.0, 0.0)),)) == (pytest.approx(3.86), 3)


@pytest.mark.parametrize(
    ("out_m", "waited"), [(4.9, 3), (5.25, 0)], ids=["ten metres on it is behind her", "it is still ahead"]
)
def test_whether_a_path_leads_back_is_looked_at_ten_metres_on(out_m, waited):
    """Out along the slope and straight back: she is 2 m past the good water when the lock is in question."""

    def hairpin(reach_m):
        return (NorthEast((11.2 + out_m - abs(reach_m - out_m), 0.0)),)

    assert locked_at(True, path=hairpin)[1] == waited


def test_neutral_ends_with_the_doubt():
    run = Run(DepthGuardConfig(input=RAW.model_copy(update={"sigma_m": 0.01})))
    seen = []
    for number, altitude_m in enumerate([5.0 - 0.01 * step for step in range(114)] + [3.91] * 3):
        state = at(0.1 * number, 1.0)
        run.guard.measure(Distance(number * 100_000, altitude_m), state)
        back = (NorthEast((0.0, 0.0)),)
        out = run.guard.step(number * 100_000, state, altitude_m < 3.95, lambda reach_m, back=back: back, stopping)
        seen.append((out.state, out.neutral))
    assert seen[-6:] == [(CORRECTION, True)] * 3 + [(CORRECTION, False)] * 3


def test_what_was_sounded_on_the_way_in_does_not_bar_a_corrections_way_out():
    """3.92 m under the keel ahead: a stop in good water at 4.3 m, none for a correction that has come back to 4.05 m."""
    guard = DepthGuard(DepthGuardConfig(input=RAW, rate_look_ahead=False), HULL)
    for _ in range(10):
        guard.memory.note(at(4.0, 0.0), 0, 3.92, 0)
    guard.memory.close_cell()
    stops = []
    for number, altitude_m in enumerate([4.3, 3.97, 4.05, 4.05]):
        guard.measure(Distance(number * 100_000, altitude_m), None)
        out = guard.step(number * 100_000, at(0.0, 2.0), True, None, stopping)
        stops.append((out.state, out.flags.depth_ahead))
    assert stops == [(OK, True)] + [(CORRECTION, False)] * 3


def test_a_correction_is_not_ended_by_one_low_reading_but_by_three_far_below():
    run = Run(DepthGuardConfig(input=RAW))
    calm = [(3.95, CORRECTION)] * 10
    far = [(3.69, CORRECTION), (3.69, CORRECTION), (3.69, LOCKED)]
    for number, (altitude_m, state) in enumerate([(5.0, OK), *calm, (3.85, CORRECTION), *calm, *far]):
        run.guard.measure(Distance(number * 100_000, altitude_m), at(0.0, 0.0))
        assert run.guard.step(number * 100_000, at(0.0, 0.0), False, None, stopping).state is state, number


def test_a_straight_lock_waits_for_nothing():
    run = Run(DepthGuardConfig(input=RAW))
    for number in range(20):
        run.guard.measure(Distance(number * 100_000, 5.0), at(0.0, 0.0))
        run.guard.step(number * 100_000, at(0.0, 0.0), False, None, stopping)
    run.guard.measure(Distance(2_000_000, 3.85), at(0.0, 0.0))
    assert run.guard.step(2_000_000, at(0.0, 0.0), False, None, stopping).state is LOCKED


def test_forgetting_takes_own_soundings_only():
    guard = DepthGuard(DepthGuardConfig(), OTTER)
    guard.set_map(chart(3.0, 60.0))
    guard.measure(Distance(0, 1.5), at(0.0, 2.0))
    here = at(0.0, 2.0)
    assert guard.forget(here.lat_rad, here.lon_rad, 20.0) == (1, pytest.approx(1.7, abs=0.011))
    assert guard.forget(here.lat_rad, here.lon_rad, 20.0) == (0, None)
    assert guard.check_plan([PlanLeg(7, (ORIGIN, offset(*ORIGIN, 80.0, 0.0)))]) is not None
    without = DepthGuard(DepthGuardConfig(memory=DepthMemoryConfig(enabled=False)), OTTER)
    assert without.forget(here.lat_rad, here.lon_rad, 20.0) == (0, None)


def test_the_share_of_a_plan_in_unknown_water():
    legs = [PlanLeg(7, (ORIGIN, offset(*ORIGIN, 80.0, 0.0)))]
    guard = DepthGuard(DepthGuardConfig(input=RAW), HULL)
    assert guard.unknown_share(legs) is None
    guard.set_map(chart(3.0, 60.0))
    assert 0.0 <= guard.unknown_share(legs) < 1.0
    assert guard.unknown_share([PlanLeg(7, (offset(*ORIGIN, 9e3, 0.0), offset(*ORIGIN, 9.5e3, 0.0)))]) == 1.0
    assert guard.unknown_share([PlanLeg(7, (ORIGIN,))]) == 0.0
    off = DepthGuard(DepthGuardConfig(enabled=False), HULL)
    off.set_map(chart(3.0, 60.0))
    assert off.unknown_share(legs) is None
