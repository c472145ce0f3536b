"""Every row of the IMC table is true: what it names exists, and outgoing values survive the way through a frame."""

from __future__ import annotations

import dataclasses
import importlib
import math
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language import imc_table, messages as imc, requests, snapshot
from mavlink_bridge.language.messages import (
    ActuatorOutput,
    ActuatorStatus,
    Desired,
    Distance,
    EstimatedState,
    FixType,
    GpsFix,
    Mode,
    PathControlState,
    PlanState,
)
from mavlink_bridge.language.snapshot import Health, Progress, Snapshot
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer

NAMES = {message.msgname: message for message in dialect.mavlink_map.values()}


@pytest.mark.parametrize("row", imc_table.FIELDS, ids=lambda row: f"{row.imc}-{row.mavlink}")
def test_what_a_row_names_exists(row):
    assert row.rule
    if row.code:
        assert imc_table_code(row.code), row.code
    if row.mavlink.startswith("MAV_CMD_"):
        assert hasattr(dialect, row.mavlink)
    elif row.mavlink:
        message, _, field = row.mavlink.partition(".")
        assert field in NAMES[message].fieldnames
    if row.ours:
        owner, _, field = row.ours.partition(".")
        place = next(module for module in (imc, requests, snapshot) if hasattr(module, owner))
        if field:
            assert field in {each.name for each in dataclasses.fields(getattr(place, owner))}


def test_a_row_without_code_says_why():
    assert all(len(row.rule) > 20 for row in imc_table.FIELDS if not row.code)


def test_every_field_of_the_source_table_has_a_row():
    # the messages of dune-imc 2.1
    covered = " ".join(row.imc for row in imc_table.FIELDS)
    for message in (
        *("GpsFix", "EulerAngles", "EstimatedState", "SetThrusterActuation", "SetServoPosition", "DesiredHeading"),
        *("DesiredSpeed", "ControlLoops", "Abort", "EntityState", "VehicleState", "PlanControl", "PlanSpecification"),
        *("PlanControlState", "PathControlState", "StateReport", "JSON plan"),
    ):
        assert message in covered


def test_the_page_is_rendered_and_is_up_to_date():
    text = imc_table.imc_table_markdown()
    assert text.count("\n| ") > 80
    page = Path(__file__).resolve().parents[2] / "docs" / "IMC.md"
    if page.exists():
        assert text in page.read_text(encoding="utf-8"), "docs/IMC.md is old: make docs"


def through(packed):
    """Packed telemetry as a ground station reads it."""
    (frame,) = Deframer().receive(Codec(1, 1).seal(*packed), 0)
    return decode(frame)


def picture(**parts):
    state = parts.pop("state", EstimatedState(5_000_000))
    output = ActuatorOutput(0, 0.0, 0.0, 0.0, 0.0, "test")
    return Snapshot(5_000_000, 100, state, parts.pop("mode", Mode.AUTO), True, output, **parts)


angle = st.floats(-math.pi, math.pi)
latitude, longitude = st.floats(-1.5, 1.5), st.floats(-3.14, 3.14)
speed = st.floats(0.0, 30.0)
QUANTUM = math.radians(1e-7)


def degrees_apart(left_deg, right_rad):
    return abs(math.remainder(left_deg - math.degrees(right_rad), 360.0))


@settings(max_examples=60, deadline=None)
@given(latitude, longitude, speed, angle, st.floats(-100.0, 9_000.0), st.floats(0.0, 50.0), st.sampled_from(FixType))
def test_gps_fix(lat, lon, sog, cog, height, dop, kind):
    fix = GpsFix(
        *(1, kind, lat, lon, height, height + 50.0, 1_655_288_676_000_000, 17),
        *(dop, dop / 2.0, dop, dop * 2.0, sog, cog),
    )
    message = through(imc_table_code("mavlink/telemetry/motion.gps_raw_int")(picture(fix=fix)))
    assert message.fix_type == (kind if kind > FixType.NONE else 1)
    assert message.time_usec == 1_655_288_676_000_000
    assert message.satellites_visible == 17
    assert message.vel / 100.0 == pytest.approx(sog, abs=0.0051)
    assert degrees_apart(message.cog / 100.0, cog) <= 0.0051
    assert (message.eph / 100.0, message.epv / 100.0) == pytest.approx((dop, dop / 2.0), abs=0.0051)
    assert (message.h_acc / 1000.0, message.v_acc / 1000.0) == pytest.approx((dop, dop * 2.0), abs=0.00051)
    if kind > FixType.NONE:
        assert math.radians(message.lat / 1e7) == pytest.approx(lat, abs=QUANTUM)
        assert math.radians(message.lon / 1e7) == pytest.approx(lon, abs=QUANTUM)
        assert message.alt / 1000.0 == pytest.approx(height, abs=0.00051)
        assert message.alt_ellipsoid / 1000.0 == pytest.approx(height + 50.0, abs=0.00051)
    else:
        assert (message.lat, message.lon) == (0, 0)


def imc_table_code(path):
    module, _, name = path.replace("/", ".").rpartition(".")
    return getattr(importlib.import_module(f"mavlink_bridge.{module}"), name)


def code_of(ours, mavlink):
    (row,) = [row for row in imc_table.FIELDS if (row.ours, row.mavlink) == (ours, mavlink)]
    return imc_table_code(row.code)


# (field of EstimatedState, MESSAGE.field, how a station reads the field back, step of the field)
STATE_ROWS = [
    ("phi_rad", "ATTITUDE.roll", lambda raw: raw, 1e-6),
    ("theta_rad", "ATTITUDE.pitch", lambda raw: raw, 1e-6),
    ("psi_rad", "ATTITUDE.yaw", lambda raw: raw, 1e-6),
    ("r_radps", "ATTITUDE.yawspeed", lambda raw: raw, 1e-6),
    ("lat_rad", "GLOBAL_POSITION_INT.lat", lambda raw: math.radians(raw / 1e7), QUANTUM),
    ("lon_rad", "GLOBAL_POSITION_INT.lon", lambda raw: math.radians(raw / 1e7), QUANTUM),
    ("height_msl_m", "GLOBAL_POSITION_INT.alt", lambda raw: raw / 1000.0, 0.001),
    ("vx_mps", "GLOBAL_POSITION_INT.vx", lambda raw: raw / 100.0, 0.01),
    ("vy_mps", "GLOBAL_POSITION_INT.vy", lambda raw: raw / 100.0, 0.01),
    ("x_m", "LOCAL_POSITION_NED.x", lambda raw: raw, 1e-6),
    ("y_m", "LOCAL_POSITION_NED.y", lambda raw: raw, 1e-6),
    ("vx_mps", "LOCAL_POSITION_NED.vx", lambda raw: raw, 1e-6),
    ("vy_mps", "LOCAL_POSITION_NED.vy", lambda raw: raw, 1e-6),
    ("alt_m", "ALTITUDE.bottom_clearance", lambda raw: raw, 1e-6),
    ("sog_mps", "VFR_HUD.groundspeed", lambda raw: raw, 1e-6),
]


@pytest.mark.parametrize(("field", "mavlink", "back", "step"), STATE_ROWS, ids=[row[1] for row in STATE_ROWS])
@settings(max_examples=25, deadline=None)
@given(value=st.floats(0.0, 1.5, width=32))
def test_state(field, mavlink, back, step, value):
    known = {"lat_rad": 0.7, "lon_rad": -0.1, "x_m": 1.0, "y_m": 1.0, "psi_rad": 0.4}
    state = EstimatedState(5_000_000, **(known | {field: value}))
    message = through(code_of(f"EstimatedState.{field}", mavlink)(picture(state=state)))
    assert back(getattr(message, mavlink.partition(".")[2])) == pytest.approx(value, abs=0.51 * step + 1e-7)


@settings(max_examples=60, deadline=None)
@given(angle)
def test_headings(psi):
    state = EstimatedState(5_000_000, lat_rad=0.7, lon_rad=-0.1, psi_rad=psi)
    for mavlink, scale, step in (
        ("GLOBAL_POSITION_INT.hdg", 0.01, 0.01),
        ("GPS_RAW_INT.yaw", 0.01, 0.01),
        ("VFR_HUD.heading", 1.0, 1.0),
    ):
        message = through(code_of("EstimatedState.psi_rad", mavlink)(picture(state=state)))
        assert degrees_apart(getattr(message, mavlink.partition(".")[2]) * scale, psi) <= 0.51 * step
    compact = through(imc_table_code("mavlink/telemetry/system.high_latency2")(picture(state=state), EndpointConfig()))
    assert degrees_apart(compact.heading * 2.0, psi) <= 2.01


@settings(max_examples=40, deadline=None)
@given(angle, st.floats(-50.0, 50.0), st.floats(0.0, 60_000.0), angle)
def test_path_control(bearing, cross, distance, desired):
    path = PathControlState(cross, distance, bearing, 0.7, -0.1)
    shown = picture(path=path, desired=Desired(desired, 1.5))
    message = through(code_of("PathControlState.cross_track_m", "NAV_CONTROLLER_OUTPUT.xtrack_error")(shown))
    assert message.xtrack_error == pytest.approx(cross, abs=1e-5)
    assert message.wp_dist == pytest.approx(distance, abs=0.51)
    assert degrees_apart(message.target_bearing, bearing) <= 0.51
    assert degrees_apart(message.nav_bearing, desired) <= 0.51
    target = through(code_of("Desired.psi_rad", "POSITION_TARGET_GLOBAL_INT.yaw")(shown))
    assert target.yaw == pytest.approx(desired, abs=1e-6)
    assert math.radians(target.lat_int / 1e7) == pytest.approx(0.7, abs=QUANTUM)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.2, 650.0), st.none() | st.floats(0.01, 1.0))
def test_depth(value, quality):
    shown = picture(
        distance=Distance(5_000_000, value, signal_quality=quality),
        health=Health(depth=True),
        state=EstimatedState(5_000_000),
    )
    message = through(code_of("Distance.value_m", "DISTANCE_SENSOR.current_distance")(shown))
    assert message.current_distance / 100.0 == pytest.approx(value, abs=0.0051)
    assert message.orientation == 25
    back = imc_table_code("mavlink/services/brought.distance")(message)
    assert back.value_m == pytest.approx(value, abs=0.0051)
    water = through(code_of("Distance.value_m", "WATER_DEPTH.distance")(shown))
    assert water.distance == pytest.approx(value, rel=1e-6)


def test_unknown_is_told_as_unknown():
    shown = picture()
    gps = through(imc_table_code("mavlink/telemetry/motion.gps_raw_int")(shown))
    assert (gps.fix_type, gps.vel, gps.cog, gps.eph, gps.satellites_visible, gps.yaw) == (
        0,
        65535,
        65535,
        65535,
        255,
        65535,
    )
    assert imc_table_code("mavlink/telemetry/motion.global_position_int")(shown) is None
    assert through(imc_table_code("mavlink/telemetry/motion.altitude")(shown)).bottom_clearance == -1.0
    assert imc_table_code("mavlink/telemetry/motion.distance_sensor")(shown) is None


def test_actuation_is_what_the_board_applied():
    board = ActuatorStatus(5_000_000, connected=True, applied_us=(1_600, 1_500, 1_250, 1_750))
    message = through(imc_table_code("mavlink/telemetry/system.servo_output_raw")(picture(actuator=board)))
    assert [getattr(message, f"servo{n}_raw") for n in range(1, 5)] == [1_600, 1_500, 1_250, 1_750]


@pytest.mark.parametrize(
    ("voltage_v", "cells_mv"),
    [
        (None, ()),
        (0.0, (0,)),
        (12.4, (12_400,)),
        (65.534, (65_534,)),
        (65.535, (65_534, 1)),
        (96.0, (65_534, 30_466)),
        (400.0, (*[65_534] * 6, 6_796)),
        (math.nan, ()),
    ],
)
def test_a_voltage_above_one_field_goes_on_in_the_next(voltage_v, cells_mv):
    """common.xml: the rest beyond 65.534 V stands in the next cells, cells that are not there are 65535."""
    supply = imc.SupplyVoltage(5_000_000, voltage_v)
    message = through(imc_table_code("mavlink/telemetry/system.battery_status")(picture(supply=supply)))
    assert tuple(message.voltages) == (*cells_mv, *[0xFFFF] * (10 - len(cells_mv)))


def test_plan_control_state():
    progress = Progress(PlanState.PAUSED, 3, 9, 0xAABBCCDD, 5, 6)
    for persona, shift in (("generic", 0), ("ardurover", 1)):
        config = EndpointConfig(persona=persona)
        message = through(
            imc_table_code("mavlink/telemetry/system.mission_current")(picture(progress=progress), config)
        )
        assert (message.seq, message.total, message.mission_state) == (3 + shift, 9, 4)
        assert (message.mission_id, message.fence_id, message.rally_points_id) == (0xAABBCCDD, 5, 6)
