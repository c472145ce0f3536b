"""What consoles are shown of the vessel: what its MAVLink messages say, at the promised rates, and nothing as new that is not."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from companion.imc.logbook import LogBook
from companion.imc.parts import parts
from companion.imc.picture import ImcPicture
from companion.imc.state_out import StateOut
from companion.imc.view import PlanView
from mavlink_bridge import imc
from mavlink_bridge.mavlink.wire.codec import dialect as d
from tests.imc_node_rig import UTC_S, ConsoleRig, kinds, make_node

S = 1_000_000
HEALTHY = 0x1020_01FF | 0x200000 | 0x8000 | 0x100000 | 0x1000000 | 0x2000000


def position(lat=41.2, lon=-8.7, vx=100, vy=0, hdg=9000):
    return d.MAVLink_global_position_int_message(0, round(lat * 1e7), round(lon * 1e7), 2000, 0, vx, vy, 0, hdg)


def attitude(yaw=math.pi / 2):
    return d.MAVLink_attitude_message(0, 0.1, -0.05, yaw, 0, 0, 0.02)


def fix(kind=3, utc_s=UTC_S):
    return d.MAVLink_gps_raw_int_message(
        round(utc_s * 1e6), kind, 412000000, -87000000, 2000, 90, 0xFFFF, 150, 18000, 12, 54400, 800, 0, 0, 0, 0
    )


def heartbeat():
    return d.MAVLink_heartbeat_message(11, 3, 0, 0, 4, 3)


def status(health=HEALTHY, present=HEALTHY, volts=12_600, left=80):
    return d.MAVLink_sys_status_message(present, present, health, 0, volts, 150, left, 0, 0, 0, 0, 0, 0)


def radio_age(age_s):
    return d.MAVLink_named_value_float_message(0, b"radio_age", age_s)


class Boat:
    """Picture, parts and node as the process puts them together, with a console that listens."""

    def __init__(self, hz=2.0):
        self.node = make_node()
        self.picture = ImcPicture()
        self.view = PlanView()
        self.book = LogBook(self.node.utc_s)
        self.out = StateOut(
            self.picture,
            lambda now_us: self.view,
            self.node.utc_s,
            skews=self.node.skews,
            rudder_full_rad=0.5,
            state_hz=hz,
        )
        self.node.add(self.out)
        self.node.add(self.book)
        self.console = ConsoleRig(self.node)
        self.console.announce(0)
        self.console.got.clear()

    def hear(self, now_us, *messages):
        for message in messages:
            self.picture.hear(message, now_us)
        return {type(packet.message): packet for packet in self.console.take(now_us)}

    def sail(self, seconds, *messages, hz=10, start=1):
        """Every message ``hz`` times a second, the console alive."""
        found = []
        for step in range(round(seconds * hz)):
            now_us = start * S + step * S // hz
            for message in messages:
                self.picture.hear(message, now_us)
            if step % hz == 0:
                found += self.console.say(imc.Heartbeat(), now_us)
            found += self.console.take(now_us)
        return found


def test_where_the_vessel_is_and_how_it_moves():
    boat = Boat()
    told = boat.hear(S, heartbeat(), position(vx=0, vy=150), attitude(), fix())
    state = told[imc.EstimatedState].message
    assert math.degrees(state.lat_rad) == pytest.approx(41.2, abs=1e-7)
    assert math.degrees(state.lon_rad) == pytest.approx(-8.7, abs=1e-7)
    assert (state.vx_mps, state.vy_mps) == pytest.approx((0.0, 1.5))
    assert (state.u_mps, state.v_mps) == pytest.approx((1.5, 0.0), abs=1e-6)
    assert (state.phi_rad, state.theta_rad, state.r_radps) == pytest.approx((0.1, -0.05, 0.02))
    assert state.psi_rad == pytest.approx(math.pi / 2)
    assert state.height_m == pytest.approx(54.4)
    assert state.alt_m == -1.0
    angles = told[imc.EulerAngles].message
    assert (angles.psi_rad, angles.time_s) == (pytest.approx(math.pi / 2), pytest.approx(UTC_S + 1))


def test_a_fix_says_which_of_its_fields_mean_anything():
    told = Boat().hear(S, fix())[imc.GpsFix].message
    valid = imc.FixValidity
    assert (
        told.validity == valid.DATE | valid.TIME | valid.POSITION | valid.COURSE | valid.SPEED | valid.HDOP | valid.HACC
    )
    assert (told.utc_year, told.utc_month, told.utc_day) == (2026, 9, 21)
    assert (told.satellites, told.sog_mps, told.hacc_m) == (12, pytest.approx(1.5), pytest.approx(0.8))
    nothing = (
        Boat()
        .hear(S, d.MAVLink_gps_raw_int_message(5, 1, 0, 0, 0, 65535, 65535, 65535, 65535, 255))[imc.GpsFix]
        .message
    )
    assert nothing.validity == 0
    assert (nothing.lat_rad, nothing.satellites) == (0.0, 0)


def test_the_rates_are_as_promised_and_a_tenth_of_the_peers():
    boat = Boat()
    servo = d.MAVLink_servo_output_raw_message(0, 0, 1600, 1400, 1500, 1500, 0, 0, 0, 0)
    nav = d.MAVLink_nav_controller_output_message(0, 0, 90, 90, 20, 0, 0, -0.4)
    target = d.MAVLink_position_target_global_int_message(0, 0, 0, 412010000, -87000000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    sonar = d.MAVLink_distance_sensor_message(0, 0, 1000, 420, 1, 0, 25, 255)
    boat.view = PlanView(imc.PlanState.EXECUTING, "p", "M1", 450, S, operation=imc.OpMode.MANEUVER)
    found = boat.sail(60, heartbeat(), position(), attitude(), fix(), status(), servo, nav, target, sonar)
    per_minute = Counter(kinds(found))
    assert 115 <= per_minute[imc.EstimatedState] <= 121
    for each in (imc.VehicleState, imc.PlanControlState, imc.ManeuverControlState):
        assert 55 <= per_minute[each] <= 61, each
    for each in (imc.GpsFix, imc.EulerAngles, imc.Distance):
        assert 11 <= per_minute[each] <= 13, each
    assert 28 <= per_minute[imc.PathControlState] <= 31
    assert per_minute[imc.SetThrusterActuation] == per_minute[imc.SetServoPosition] >= 56
    assert 6 <= per_minute[imc.FuelLevel] <= 7
    assert per_minute[imc.Heartbeat] >= 59
    size = sum(len(imc.encode(packet)) for packet in found)
    assert size / 60 < 830  # the peer sends 8300 B/s


def test_nothing_is_told_again_that_has_not_come_anew():
    boat = Boat()
    boat.hear(S, heartbeat(), position(), attitude(), fix(), status())
    later = [packet for at in range(2, 6) for packet in boat.console.say(imc.Heartbeat(), at * S)]
    seen = set(kinds(later))
    assert imc.VehicleState in seen  # the heartbeat is young enough
    assert not seen & {imc.EstimatedState, imc.GpsFix, imc.EulerAngles, imc.FuelLevel}


def test_without_a_heading_there_is_no_state_and_a_moving_vessel_shows_its_course():
    assert imc.EstimatedState not in Boat().hear(S, heartbeat(), position(vx=0, hdg=0xFFFF))
    moving = Boat().hear(S, heartbeat(), position(vx=0, vy=100, hdg=0xFFFF))
    assert moving[imc.EstimatedState].message.psi_rad == pytest.approx(math.pi / 2)


def test_a_vehicle_that_is_silent_is_told_as_silent_and_as_nothing_else():
    boat = Boat()
    boat.hear(S, heartbeat(), position(), attitude())
    found = [packet for at in range(8, 14) for packet in boat.console.say(imc.Heartbeat(), at * S)]
    assert not {imc.VehicleState, imc.EstimatedState, imc.PlanControlState} & set(kinds(found))
    words = [packet.message.description for packet in found if isinstance(packet.message, imc.EntityState)]
    assert any("has been silent for 7 s" in text for text in words)
    assert imc.VehicleState in boat.hear(14 * S, heartbeat())


def test_a_console_that_comes_later_is_told_all_that_is_true_at_once():
    boat = Boat()
    boat.hear(S, heartbeat(), position(), attitude(), fix(), status())
    other = ConsoleRig(boat.node, "10.77.0.5", 0x4002, "ccu-b")
    got = set(kinds(other.announce(S + S // 10)))
    assert {
        imc.Announce,
        imc.Heartbeat,
        imc.VehicleState,
        imc.EstimatedState,
        imc.PlanControlState,
        imc.EntityState,
    } <= got


def test_the_plan_and_the_mode_are_told_in_the_moment_in_which_they_change():
    boat = Boat()
    boat.hear(S, heartbeat())
    boat.view = PlanView(imc.PlanState.EXECUTING, "plan1", "G1", 450, S, 12.5, 60, 20, operation=imc.OpMode.MANEUVER)
    told = boat.hear(S + 50_000, heartbeat())
    state, plan = told[imc.VehicleState].message, told[imc.PlanControlState].message
    assert (state.op_mode, state.maneuver_type, state.control_loops) == (imc.OpMode.MANEUVER, 450, 0xC1)
    assert state.maneuver_stime_s == pytest.approx(UTC_S + 1)
    assert (plan.plan_id, plan.man_id, plan.man_type, plan.plan_progress_pct, plan.plan_eta_s) == (
        "plan1",
        "G1",
        450,
        12.5,
        60,
    )
    assert told[imc.ManeuverControlState].message.state == imc.ManeuverProgress.EXECUTING
    boat.view = PlanView(imc.PlanState.READY, "plan1", last_outcome=imc.Outcome.SUCCESS, maneuver_done=True)
    ended = boat.hear(S + 100_000, heartbeat())
    assert ended[imc.ManeuverControlState].message.state == imc.ManeuverProgress.DONE
    assert ended[imc.VehicleState].message.maneuver_type == imc.NULL_MESSAGE
    assert (ended[imc.PlanControlState].message.plan_id, ended[imc.PlanControlState].message.man_type) == (
        "plan1",
        0xFFFF,
    )


def test_sticks_and_errors_are_shown_as_the_console_knows_them():
    boat = Boat()
    boat.view = PlanView(imc.PlanState.EXECUTING, "t", "T", 452, S, operation=imc.OpMode.MANEUVER)
    assert boat.hear(S, heartbeat())[imc.VehicleState].message.control_loops == imc.ControlLoops.TELEOPERATION
    boat.view = PlanView(imc.PlanState.BLOCKED, operation=imc.OpMode.ERROR, last_error="aborted", last_error_us=S)
    state = boat.hear(2 * S, heartbeat())[imc.VehicleState].message
    assert (state.op_mode, state.last_error, state.last_error_time_s) == (imc.OpMode.ERROR, "aborted", UTC_S + 1)


def test_each_part_is_told_in_words_and_counted_when_it_fails():
    boat = Boat()
    found = boat.sail(3, heartbeat(), status(health=HEALTHY & ~0x20, present=HEALTHY & ~0x100), fix(kind=3))
    numbers = boat.node.entities
    words = {
        label: packet.message
        for packet in found
        if isinstance(packet.message, imc.EntityState)
        for label, number in numbers.items()
        if number == packet.header.source_entity
    }
    assert (words["GPS"].state, words["GPS"].description) == (imc.EntityCondition.ERROR, "no usable fix")
    assert (words["Sounder"].state, words["Sounder"].description) == (
        imc.EntityCondition.NORMAL,
        "not fitted; no depth guard",
    )
    assert words["Battery"].description == "12.6 V, 80 %"
    assert words["Vehicle Link"].state == imc.EntityCondition.NORMAL
    state = next(packet.message for packet in reversed(found) if isinstance(packet.message, imc.VehicleState))
    assert (state.error_count, state.error_ents) == (1, "GPS")


def told_of(label: str, *heard) -> tuple[int, str]:
    boat = Boat()
    for message in (heartbeat(), *heard):
        boat.picture.hear(message, S)
    state = dict(parts(boat.picture, S, ()))[label]
    return state.state, state.description


@pytest.mark.parametrize(
    ("enabled", "fence_id", "radio", "said"),
    [
        (True, 7, False, (imc.EntityCondition.NORMAL, "inside")),
        (False, 0, False, (imc.EntityCondition.NORMAL, "none")),
        (False, 7, False, (imc.EntityCondition.FAULT, "a fence is aboard, but switched off")),
        (False, 0, True, (imc.EntityCondition.NORMAL, "not told by radio")),
    ],
)
def test_a_fence_that_is_not_there_or_not_kept_is_not_told_as_kept(enabled, fence_id, radio, said):
    bits = HEALTHY if enabled else HEALTHY & ~0x100000
    state = d.MAVLink_sys_status_message(HEALTHY, bits, HEALTHY, 0, 12_600, 150, 80, 0, 0, 0, 0, 0, 0)
    mission = d.MAVLink_mission_current_message(0, fence_id=fence_id)
    assert told_of("Fence", state, mission, *([radio_age(1.0)] if radio else [])) == said


def test_a_sounder_that_is_there_while_its_guard_is_switched_off_is_a_fault():
    off = status(health=HEALTHY & ~0x100, present=HEALTHY & ~0x100)

    def depth(distance_m):
        return d.MAVLink_water_depth_message(0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, distance_m, math.nan)

    said = imc.EntityCondition.FAULT, "fitted, but the depth guard is switched off"
    assert told_of("Sounder", off, depth(6.0)) == told_of("Sounder", off, depth(math.nan)) == said
    assert told_of("Sounder", off) == (imc.EntityCondition.NORMAL, "not fitted; no depth guard")
    assert told_of("Sounder", off, radio_age(1.0)) == (imc.EntityCondition.NORMAL, "no depth is told by radio")


def test_what_the_actuators_were_given_by_the_boards_own_word():
    boat = Boat()
    boat.picture.hear(d.MAVLink_servo_output_raw_message(0, 0, 2000, 1250, 1500, 1700, 0, 0, 0, 0), S)
    got = [packet.message for packet in boat.console.take(S)]
    assert [(m.id, m.value) for m in got if isinstance(m, imc.SetThrusterActuation)] == [(0, 1.0), (1, -0.5)]
    rudders = [(m.id, pytest.approx(m.value_rad)) for m in got if isinstance(m, imc.SetServoPosition)]
    assert rudders == [(0, 0.0), (1, 0.2)]
    silent = Boat()
    silent.picture.hear(d.MAVLink_servo_output_raw_message(0, 0, 0, 0, 0, 0, 0, 0, 0, 0), S)
    assert not {imc.SetThrusterActuation, imc.SetServoPosition} & set(kinds(silent.console.take(S)))


def test_the_path_with_its_side_and_its_end():
    boat = Boat()
    nav = d.MAVLink_nav_controller_output_message(0, 0, 90, 80, 20, 0, 0, -0.4)
    target = d.MAVLink_position_target_global_int_message(0, 0, 0, 412010000, -87000000, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    orbit = d.MAVLink_orbit_execution_status_message(0, -15.0, 0, 412010000, -87000000, 0)
    path = boat.hear(S, heartbeat(), position(vx=0, vy=100), attitude(), nav, target, orbit)[
        imc.PathControlState
    ].message
    assert (path.x_m, path.y_m, path.eta_s, path.lradius_m) == (20.0, pytest.approx(-0.4), 20, 15.0)
    assert path.flags == imc.PathFlags.NO_Z | imc.PathFlags.LOITERING | imc.PathFlags.CCLOCKW
    assert math.degrees(path.end_lat_rad) == pytest.approx(41.201)
    assert math.degrees(path.course_error_rad) == pytest.approx(10.0, abs=1e-3)


def test_a_state_that_crossed_a_radio_is_told_once_with_its_age():
    boat = Boat()
    found = []
    for step in range(60):
        now_us = S + step * S // 2
        age_s = 3.0 + (step % 20) * 0.5  # a new state each 10 s, 3 s old when it is here
        found += boat.hear(now_us, heartbeat(), radio_age(age_s), position(), attitude()).values()
        boat.console.say(imc.Heartbeat(), now_us)
    states = [packet for packet in found if isinstance(packet.message, imc.EstimatedState)]
    assert len(states) == 3
    assert states[1].header.utc_s == pytest.approx(UTC_S + 11 - 3.0, abs=0.01)
    reports = [packet.message for packet in found if isinstance(packet.message, imc.StateReport)]
    assert [report.stime_s for report in reports] == [round(UTC_S) + at - 3 for at in (1, 11, 21)]
    assert reports[0].latitude_deg == pytest.approx(41.2, abs=1e-5)
    assert reports[0].depth_dm == 0
    assert reports[0].altitude_dm == 0xFFFF


def test_a_gateway_that_has_heard_nothing_yet_tells_no_state():
    boat = Boat()
    assert imc.EstimatedState not in boat.hear(S, heartbeat(), radio_age(-1.0), position(), attitude())


def test_the_vessels_texts_are_a_log_book():
    boat = Boat()
    boat.book.note(4, "vehicle", "Depth: 1.2 m", S)
    boat.book.note(2, "vehicle", "Actuators: silent", 2 * S)
    told = [packet.message for packet in boat.console.take(3 * S) if isinstance(packet.message, imc.LogBookEntry)]
    assert [(entry.type, entry.text) for entry in told] == [
        (imc.LogBookType.WARNING, "Depth: 1.2 m"),
        (imc.LogBookType.CRITICAL, "Actuators: silent"),
    ]
    ask = imc.LogBookControl(imc.LogBookCommand.GET, UTC_S + 1.5)
    (reply,) = [each.message for each in boat.console.say(ask, 4 * S) if isinstance(each.message, imc.LogBookControl)]
    assert [entry.text for entry in reply.msg] == ["Actuators: silent"]
    errors = imc.LogBookControl(imc.LogBookCommand.GET_ERR)
    (reply,) = [
        each.message for each in boat.console.say(errors, 5 * S) if isinstance(each.message, imc.LogBookControl)
    ]
    assert [entry.text for entry in reply.msg] == ["Actuators: silent"]
    boat.console.say(imc.LogBookControl(imc.LogBookCommand.CLEAR), 6 * S)
    (reply,) = [
        each.message
        for each in boat.console.say(imc.LogBookControl(), 7 * S)
        if isinstance(each.message, imc.LogBookControl)
    ]
    assert len(reply.msg) == 2
