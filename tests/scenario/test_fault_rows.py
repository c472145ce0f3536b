"""Rows of the fault matrix (firmware-reliability §C) on the whole vessel, in virtual time, measured at the board's pins."""

from __future__ import annotations

import math

import pytest

from mavlink_bridge.language.messages import Action, GuardState, Mode
from mavlink_bridge.language.requests import (
    Arm,
    DistanceInput,
    GuidedHeading,
    GuidedTarget,
    ManualInput,
    PlanItem,
    PlanKind,
    SetMode,
    Terminate,
)

FAR = (300.0, 0.0)
TICK_S = 0.05
SET_MODE, MANUAL, HOLD = 176, 0.0, 4.0
"""MAV_CMD_DO_SET_MODE, and modes as the persona ardurover numbers them."""


def under_way(voyage, *overrides, speed_mps=1.5, seed=1):
    trip = voyage(*overrides, seed=seed)
    trip.sail(speed_mps, FAR, after_s=15.0)
    assert not trip.neutral
    assert trip.snapshot.state.sog_mps > 0.8 * speed_mps
    return trip


def neutral_after(trip, limit_s):
    return trip.until(lambda: trip.neutral, limit_s)


def test_row_04_an_exception_in_an_endpoint_leaves_control_alone(voyage, measured, monkeypatch):
    trip = under_way(voyage)
    app = trip.world.app
    north_m = trip.truth.north_m

    def fail(*arguments, **named):
        raise RuntimeError("telemetry fails")

    monkeypatch.setattr(app.grounds[0], "tick", fail)
    ticks = trip.snapshot.tick
    trip.run(3.0)
    assert trip.snapshot.armed
    assert trip.snapshot.tick == ticks + 60, "no tick lost"
    assert trip.truth.north_m > north_m + 3.0, "it sails on"
    assert trip.texts.count("gcs failed (RuntimeError), tried again in a second") == 3
    trip.run(2.5)
    assert "task_failing" in trip.snapshot.causes, "five in a minute"
    assert not trip.snapshot.armed
    assert trip.neutral
    measured(4, "no tick lost; tried again after 1 s; the fifth in a minute disarms")


def test_row_04_what_recovers_goes_on(voyage, monkeypatch):
    trip = under_way(voyage)
    app = trip.world.app
    end = trip.world.ground("gcs")
    with monkeypatch.context() as patch:
        patch.setattr(app.grounds[0], "flush", lambda now_us: 1 / 0)
        trip.run(0.5)
    end.poll(trip.world.now_us)
    trip.run(1.5)
    assert end.poll(trip.world.now_us), "telemetry is back within a second"
    assert trip.snapshot.armed


def test_row_05_an_exception_in_the_control_tick_is_neutral_in_the_same_tick(voyage, measured, monkeypatch):
    trip = under_way(voyage)
    vehicle = trip.world.app.vehicle

    def fail(*arguments):
        raise RuntimeError("control fails")

    monkeypatch.setattr(vehicle, "_demand", fail)
    began_us = trip.world.now_us
    while not trip.neutral and trip.world.now_us - began_us < 300_000:
        trip.world.tick()
    took_ms = (trip.world.now_us - began_us) / 1e3
    assert took_ms <= 100.0
    measured(5, f"{took_ms:.0f} ms")


def test_row_13_the_board_applies_something_else(voyage, measured):
    trip = under_way(voyage)
    command = trip.board._command

    def deaf(found, now_us):
        heard = list(trip.board._target)
        command(found, now_us)
        trip.board._target = [1900, 1100, heard[2], heard[3]]

    trip.board._command = deaf
    took_s = trip.until(lambda: not trip.snapshot.armed, 1.0)
    assert took_s <= 0.4
    assert "actuator_mismatch" in trip.snapshot.causes
    measured(13, f"{took_s * 1e3:.0f} ms")


@pytest.mark.parametrize("fault", ["gnss_silent", "no_fix"])
def test_row_21_row_22_position_lost(voyage, measured, fault):
    trip = under_way(voyage)
    setattr(trip.faults, fault, True)
    took_s = neutral_after(trip, 2.5)
    assert trip.snapshot.action is Action.STOP
    assert "position_lost" in trip.snapshot.causes
    assert took_s <= (1.45 if fault == "gnss_silent" else 0.6)
    measured(21 if fault == "gnss_silent" else 22, f"{took_s * 1e3:.0f} ms")
    setattr(trip.faults, fault, False)
    trip.run(7.0)
    assert trip.neutral, "nothing resumes by itself"
    assert trip.mode(Mode.AUTO).reason == ""
    trip.run(2.0)
    assert not trip.neutral


def test_row_21_manual_goes_on_without_position(voyage):
    trip = voyage()
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    trip.faults.gnss_silent = True
    for _ in range(30):
        trip.ask(ManualInput(0.5, 0.0, 255))
    assert not trip.neutral


def test_row_23_a_position_jump_is_not_steered_on(voyage, measured):
    trip = under_way(voyage)
    before = trip.snapshot.state
    trip.faults.jump_east_m = 80.0
    furthest_m = 0.0
    for _ in range(100):
        trip.step()
        state = trip.snapshot.state
        if state.y_m is not None:
            furthest_m = max(furthest_m, abs(state.y_m - before.y_m))
        if trip.neutral:
            break
    assert trip.neutral, "invalid after the hold"
    assert furthest_m < 5.0
    assert abs(trip.truth.east_m) < 5.0
    measured(23, "estimate moved less than 5 m, then stop")


def test_row_24_a_frozen_receiver_is_warned_of_and_stopped(voyage, measured):
    trip = under_way(voyage)
    trip.faults.frozen = True
    warned_s = trip.until(lambda: "position_frozen" in trip.snapshot.causes or trip.neutral, 8.0)
    stopped_s = warned_s + neutral_after(trip, 8.0)
    assert stopped_s <= 11.0
    measured(24, f"warned {warned_s:.1f} s, stopped {stopped_s:.1f} s")


def test_row_30_heading_lost(voyage, measured):
    """Above 1 m/s the course stands in; below it the vessel stops."""
    trip = under_way(voyage)
    trip.faults.heading_silent = True
    trip.run(3.0)
    assert trip.snapshot.armed
    assert trip.snapshot.state.heading_valid
    slow = under_way(voyage, speed_mps=0.6)
    slow.faults.heading_silent = True
    slow.faults.rate_silent = True
    took_s = neutral_after(slow, 30.0)
    assert "heading_lost" in slow.snapshot.causes
    measured(30, f"course stands in; below 1 m/s neutral after {took_s * 1e3:.0f} ms")


def test_row_31_a_flipped_heading_is_not_believed(voyage, measured):
    trip = under_way(voyage)
    trip.faults.heading_bias_deg = 180.0
    trip.run(4.0)
    assert abs(trip.truth.east_m) < 10.0
    turned = abs(math.remainder(trip.truth.psi_rad, 2.0 * math.pi))
    assert turned < math.radians(45.0), "it did not turn about"
    measured(31, "never steered on")


def test_row_35_the_machine_stood_still(voyage, measured):
    trip = under_way(voyage)
    app = trip.world.app
    later_us = trip.world.now_us + 10_000_000
    snapshot = app.tick(later_us)
    assert "time_jump" in snapshot.causes
    assert not snapshot.armed
    assert snapshot.output.cause.startswith(("failsafe", "disarmed"))
    assert (snapshot.output.thruster_port, snapshot.output.rudder_port_rad) == (0.0, 0.0)
    measured(35, "the first tick after")


GROUND = ("operator.gcs_required=true",)


def test_row_36_ground_station_lost_acts_within_5_2_s(voyage, measured):
    """Must hold: with a 5 s timeout within 5.2 s (ArduRover 6.6 s)."""
    trip = voyage(*GROUND)
    heard = Heartbeats(trip)
    heard.run(1.5)
    heard.sail(1.5, FAR)
    heard.run(10.0)
    assert trip.snapshot.mode is Mode.AUTO
    heard.silent = True
    last_s = heard.last_s
    trip.until(lambda: trip.snapshot.action >= Action.HOLD, 7.0)
    took_s = trip.now_s - last_s
    assert trip.snapshot.mode is Mode.HOLD
    assert took_s <= 5.2
    measured(36, f"{took_s:.2f} s")
    trip.faults.no_fix = True
    neutral_after(trip, 1.0)
    assert trip.snapshot.action is Action.STOP


class Heartbeats:
    """A ground station that sends nothing but heartbeats."""

    def __init__(self, trip, link="gcs") -> None:
        from pymavlink.dialects.v20 import common

        self.trip = trip
        self.link = trip.world.ground(link)
        self.maker = common.MAVLink(None, 255, 190)
        self.message = common.MAVLink_heartbeat_message(6, 8, 192, 0, 4, 3)
        self.silent = False
        self.last_s = -1.0

    def run(self, seconds) -> None:
        end_s = self.trip.now_s + seconds
        while self.trip.now_s < end_s:
            self.beat()
            self.trip.step()

    def beat(self) -> None:
        self.link.poll(self.trip.world.now_us)
        if not self.silent and self.trip.now_s - self.last_s >= 1.0:
            self.link.write(0, self.message.pack(self.maker))
            self.maker.seq = (self.maker.seq + 1) % 256
            self.last_s = self.trip.now_s

    def sail(self, speed_mps, *points) -> None:
        replies = [self.trip.plan(speed_mps, *points)]
        self.beat()
        replies.append(self.trip.ask(Arm(arm=True)))
        replies.append(self.trip.mode(Mode.AUTO))
        assert [reply.reason for reply in replies] == ["", "", ""]


def test_row_37_the_sticks_stop(voyage, measured):
    trip = voyage()
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    for _ in range(20):
        trip.world.app.submit(ManualInput(0.6, 0.2, 255))
        trip.step()
    assert not trip.neutral
    took_s = neutral_after(trip, 1.0)
    assert took_s <= 0.6
    assert trip.snapshot.mode is Mode.MANUAL
    assert trip.snapshot.armed
    measured(37, f"{took_s * 1e3:.0f} ms")


def test_row_38_guided_set_points_stop(voyage, measured):
    trip = voyage()
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.GUIDED).reason == ""
    for _ in range(60):
        trip.world.app.submit(GuidedHeading(0.0, 1.5, stream=True))
        trip.step()
    assert trip.snapshot.mode is Mode.GUIDED
    took_s = trip.until(lambda: trip.snapshot.action >= Action.HOLD, 2.0)
    assert took_s <= 1.1
    assert trip.snapshot.mode is Mode.HOLD
    measured(38, f"{took_s:.2f} s")


def test_row_41_only_the_owner_of_the_sticks_is_obeyed(voyage):
    trip = voyage()
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    for _ in range(20):
        trip.world.app.submit(ManualInput(0.6, 0.0, 255))
        trip.step()
    reply = trip.ask(ManualInput(-1.0, 0.0, 254))
    trip.world.app.submit(ManualInput(0.6, 0.0, 255))
    trip.step()
    assert trip.snapshot.output.thruster_port >= 0.0
    assert reply is not None


def test_row_61_depth_below_the_minimum(voyage, measured):
    """Two readings below, from one to the next: neutral within 200 ms of the second that passed the gate."""
    trip = under_way(voyage, "world.bottom.kind=flat", "depth.rate_look_ahead=false", "world.sensors.sounder_outlier=0")
    trip.faults.depth_bias_m = -16.7
    took_s = neutral_after(trip, 2.0)
    # 10 Hz: the gate asks three readings to agree on a jump, of which the second is the matrix's second sample.
    assert took_s <= 0.3 + 0.2
    assert trip.snapshot.guard in (GuardState.CORRECTION, GuardState.LOCKED)
    measured(61, f"{took_s * 1e3:.0f} ms after the fault, of which 300 ms for three readings")


def test_row_61_a_locked_vessel_refuses_until_the_water_is_good(voyage):
    trip = under_way(voyage, "world.bottom.kind=flat", "depth.rate_look_ahead=false", "world.sensors.sounder_outlier=0")
    trip.faults.depth_bias_m = -17.5
    neutral_after(trip, 2.0)
    assert trip.snapshot.guard is GuardState.LOCKED
    for body in (SetMode(Mode.AUTO), GuidedTarget(0.7188, -0.1519), GuidedHeading(0.0, 1.0)):
        assert "depth guard locked" in trip.ask(body).reason
    trip.run(5.0)
    assert trip.neutral
    assert trip.mode(Mode.MANUAL).reason == "", "by hand an operator may always sail off"
    for _ in range(20):
        trip.world.app.submit(ManualInput(-0.5, 0.0, 255))
        trip.step()
    assert not trip.neutral
    trip.faults.depth_bias_m = 0.0
    trip.run(2.0)
    assert trip.snapshot.guard is GuardState.OK


def test_row_61_a_stream_of_set_points_does_not_press_on_through_correction(voyage):
    trip = voyage(
        "world.bottom.kind=flat",
        "depth.rate_look_ahead=false",
        "depth.minimum_margin_m=0.5",
        "world.sensors.sounder_outlier=0",
    )
    assert trip.ask(Arm(arm=True)).reason == ""
    assert trip.mode(Mode.GUIDED).reason == ""
    for i in range(200):
        if i == 100:
            assert not trip.neutral
            trip.faults.depth_bias_m = -15.9
        trip.world.app.submit(GuidedHeading(0.0, 1.5, stream=True))
        trip.step()
    assert trip.snapshot.guard is GuardState.CORRECTION
    assert trip.snapshot.action is Action.STOP
    assert trip.neutral


def test_depth_from_another_component_counts_too(voyage):
    trip = voyage("world.sensors.depth_hz=0", "depth.min_altitude_m=4")
    for _ in range(10):
        trip.ask(DistanceInput(3.0, 0.9))
    assert trip.snapshot.guard is GuardState.LOCKED


def test_row_62_battery(voyage, measured):
    levels = ("monitors.battery_low_v=12", "monitors.battery_critical_v=11", "monitors.battery_empty_v=10")
    trip = under_way(voyage, *levels)
    trip.board.set_voltage(13.0)
    trip.run(3.0)
    seen = {}
    began_s = trip.now_s
    for volts, cause in ((11.5, "battery_low"), (10.5, "battery_critical"), (9.0, "battery_empty")):
        trip.board.set_voltage(volts)
        trip.until(lambda cause=cause: cause in trip.snapshot.causes, 40.0)
        seen[cause] = trip.now_s - began_s
        if cause == "battery_critical":
            assert trip.snapshot.mode is Mode.RTL
    trip.until(lambda: trip.neutral, 1.0)
    measured(62, ", ".join(f"{name} {at_s:.0f} s" for name, at_s in seen.items()))


def test_row_63_stuck_and_adrift(voyage, measured):
    trip = under_way(voyage)
    trip.world.surroundings.plant.vessel.thruster_health = [0.0, 0.0]
    warned_s = trip.until(lambda: "stuck" in trip.snapshot.causes, 40.0)
    stopped_s = warned_s + neutral_after(trip, 12.0)
    assert trip.snapshot.action is Action.STOP
    assert stopped_s <= 40.0
    measured(63, f"warned {warned_s:.0f} s, neutral {stopped_s:.0f} s after the thrust was gone")
    adrift = voyage("world.water.current_mps=0.6")
    adrift.until(lambda: "moving_in_neutral" in adrift.snapshot.causes, 15.0)


def test_row_64_emergency_stop_and_termination(voyage, measured):
    trip = under_way(voyage, speed_mps=2.5)
    trip.world.app.submit(Arm(arm=False, force=True))
    took_s = neutral_after(trip, 0.3)
    assert took_s <= 0.1 + TICK_S
    assert "aborted" in trip.snapshot.causes
    assert trip.ask(SetMode(Mode.AUTO)).reason == ""
    trip.run(1.0)
    assert trip.neutral, "latched until armed again"
    assert trip.ask(Arm(arm=True)).reason == ""
    measured(64, f"{took_s * 1e3:.0f} ms")
    trip.ask(Terminate())
    assert "terminated" in trip.ask(Arm(arm=True)).reason
    trip.run(1.0)
    assert trip.neutral


def test_row_64_during_an_upload(voyage):
    trip = under_way(voyage)
    x, y = trip.at(500.0, 0.0)
    items = [PlanItem(16, 3, 0.0, 0.0, 0.0, 0.0, x, y, 0.0)] * 500
    replies = []
    from mavlink_bridge.mavlink.missions.plan_mapping import load_plan

    trip.world.app.submit(load_plan(PlanKind.MISSION, items), replies.append)
    trip.world.app.submit(Arm(arm=False, force=True))
    assert neutral_after(trip, 0.3) <= 0.15


def test_row_34_the_wall_clock_jumps_and_nothing_notices(voyage, measured, monkeypatch):
    import time

    quiet = under_way(voyage)
    quiet.run(5.0)
    real, offset = time.time, [0.0]
    monkeypatch.setattr(time, "time", lambda: real() + offset[0])
    trip = under_way(voyage)
    for jump_s in (7 * 86_400.0, -30 * 365.0 * 86_400.0):
        offset[0] = jump_s
        trip.run(2.5)
    assert trip.snapshot.armed
    assert (trip.truth.north_m, trip.truth.psi_rad) == (quiet.truth.north_m, quiet.truth.psi_rad), "to the last bit"
    measured(34, "no difference to the last bit")


def test_row_39_one_of_three_stations_leaves(voyage, measured):
    trip = voyage(*GROUND)
    stations = [Heartbeats(trip, link) for link in ("gcs", "sdk", "tcp")]

    def run(seconds):
        end_s = trip.now_s + seconds
        while trip.now_s < end_s:
            for station in stations:
                station.beat()
            trip.step()

    run(2.0)
    stations[0].sail(1.5, FAR)
    run(5.0)
    stations[1].silent = True
    run(15.0)
    assert trip.snapshot.mode is Mode.AUTO
    assert trip.snapshot.action is Action.NONE
    measured(39, "nothing happens")


class Sticks(Heartbeats):
    """A ground station with a joystick: heartbeats, and sticks at 10 Hz while it has a surge to give."""

    def __init__(self, trip, link, system_id) -> None:
        super().__init__(trip, link)
        from pymavlink.dialects.v20 import common

        self.maker = common.MAVLink(None, system_id, 190)
        self.make = common
        self.surge = None

    def beat(self) -> None:
        super().beat()
        if self.surge is not None and not self.silent and round(self.trip.now_s / TICK_S) % 2 == 0:
            self.send(self.make.MAVLink_manual_control_message(1, 0, 0, round(1000 * self.surge), 0, 0))

    def command(self, number, *params) -> None:
        self.send(self.make.MAVLink_command_long_message(1, 1, number, 0, *params, *[0.0] * (7 - len(params))))

    def send(self, message) -> None:
        self.link.write(0, message.pack(self.maker))
        self.maker.seq = (self.maker.seq + 1) % 256


def driven(voyage, *overrides, other=254):
    """A vessel under the sticks of station 255, with another watching, both by real MAVLink; and a function that runs them."""
    trip = voyage(*GROUND, *overrides)
    owner, observer = Sticks(trip, "gcs", 255), Sticks(trip, "tcp", other)

    def run(seconds, until=None):
        began_s = trip.now_s
        while trip.now_s - began_s < seconds and not (until and until()):
            owner.beat()
            observer.beat()
            trip.step()
        return trip.now_s - began_s

    run(2.0)
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    owner.surge = 0.6
    run(3.0)
    assert not trip.neutral
    return trip, owner, observer, run


def test_row_41_a_station_of_the_same_number_on_another_link_does_not_steer_beside_the_owner(voyage):
    trip, _, observer, run = driven(voyage, other=255)
    ahead_us = trip.board.pulses_us[0]
    for surge in (-0.6, 0.0):
        observer.surge = surge
        for _ in range(20):
            run(TICK_S)
            assert trip.board.pulses_us[0] >= ahead_us, "the owner's throttle, at each tick"


def test_row_40_the_owner_of_the_sticks_leaves_and_an_observer_stays(voyage, measured):
    trip, owner, observer, run = driven(voyage)
    observer.command(SET_MODE, 1.0, MANUAL)
    observer.surge = -1.0
    run(1.0)
    assert trip.board.pulses_us[0] > 1600.0, "the observer's sticks are not obeyed while the owner is there"
    observer.surge, owner.silent = None, True
    took_s = run(5.2, until=lambda: trip.neutral)
    assert trip.neutral
    assert took_s <= 0.7, "0.6 s after the last stick"
    run(10.0)
    assert trip.neutral, "the observer's heartbeats keep no thrust alive"
    assert trip.snapshot.action is Action.STOP
    observer.surge = 0.5
    run(1.0)
    assert trip.board.pulses_us[0] > 1550.0, "now it may drive"
    assert any("Station 254 over tcp has the sticks now, not station 255 over gcs" in text for text in trip.texts), (
        "announced"
    )
    owner.silent = False
    run(1.0)
    observer.silent = True
    run(1.0, until=lambda: trip.neutral)
    assert trip.neutral, "who comes back does not snatch them"
    measured(40, f"neutral {took_s * 1e3:.0f} ms after the owner fell silent; the observer may take over")


def test_row_40_the_observer_takes_over_at_once_by_an_explicit_order(voyage):
    trip, owner, observer, run = driven(voyage)
    owner.silent = True
    run(0.8)
    observer.command(SET_MODE, 1.0, MANUAL)
    observer.surge = 0.8
    took_s = run(3.0, until=lambda: trip.board.pulses_us[0] > 1550.0)
    assert took_s < 1.5, "sooner than the sticks become free by themselves"
    observer.command(SET_MODE, 1.0, HOLD)
    run(1.0)
    assert trip.snapshot.mode is Mode.HOLD


def test_row_40_without_the_observer_it_is_row_36_and_a_listener_is_no_contact(voyage):
    """An endpoint of class telemetry hears nobody: who only listens there is no ground station in contact."""
    trip, owner, _, run = driven(voyage, "endpoints.2.link_class=telemetry")
    owner.silent = True
    took_s = run(7.0, until=lambda: "gcs_lost" in trip.snapshot.causes)
    assert took_s <= 5.3
    assert trip.neutral


def test_row_42_a_station_that_only_beats_does_not_keep_the_sticks_alive(voyage, measured):
    trip = voyage(*GROUND)
    station = Heartbeats(trip)
    station.run(1.5)
    assert trip.mode(Mode.MANUAL).reason == ""
    assert trip.ask(Arm(arm=True)).reason == ""
    for _ in range(20):
        trip.world.app.submit(ManualInput(0.6, 0.0, 255))
        station.run(TICK_S)
    assert not trip.neutral
    began_s = trip.now_s
    while not trip.neutral and trip.now_s - began_s < 2.0:
        station.run(TICK_S)
    took_s = trip.now_s - began_s
    assert took_s <= 0.6
    measured(42, f"{took_s * 1e3:.0f} ms (rule of row 37)")
