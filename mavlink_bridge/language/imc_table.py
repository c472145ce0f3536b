"""How each field of the original installation's IMC messages crosses MAVLink: the table behind ``docs/IMC.md``.

Data and one renderer. Every row names the code that does it, or the reason why nothing does; a test holds that the code, the vocabulary's
field and the MAVLink field exist, and that outgoing values survive the way through a frame. Source: dune-imc §2.1 and
§2.2, MAVLink common.xml.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ImcRow:
    """One line. ``ours``: field of the vocabulary; ``mavlink``: MESSAGE.field or command; ``code``: path.function that does it."""

    imc: str
    ours: str
    mavlink: str
    rule: str
    code: str = ""
    """Empty: not carried, and ``rule`` says why."""


# One line for each: IMC | here | MAVLink | rule, or why it is not carried | code
_FIELDS: Final = """
GpsFix.lat | GpsFix.lat_rad | GPS_RAW_INT.lat | degrees * 1e7 (1.1 cm) | motion.gps_raw_int
GpsFix.lon | GpsFix.lon_rad | GPS_RAW_INT.lon | degrees * 1e7 | motion.gps_raw_int
GpsFix.height | GpsFix.height_ellipsoid_m | GPS_RAW_INT.alt_ellipsoid | mm; IMC's height is above the ellipsoid | motion.gps_raw_int
(GGA) | GpsFix.height_msl_m | GPS_RAW_INT.alt | mm above mean sea level | motion.gps_raw_int
GpsFix.type, validity | GpsFix.fix_type | GPS_RAW_INT.fix_type | none 1, 2-D 2, 3-D 3, DGPS 4, RTK float 5, RTK fixed 6; dead
    reckoning counts as none | motion.gps_raw_int
GpsFix.utc_* | GpsFix.utc_us | GPS_RAW_INT.time_usec | us since 1970 only when date and time are valid, else time since start |
    motion.gps_raw_int
GpsFix.utc_* | Snapshot.utc_us | SYSTEM_TIME.time_unix_usec | us; 0 = unknown | system.system_time
GpsFix.satellites | GpsFix.satellites | GPS_RAW_INT.satellites_visible | 255 = unknown | motion.gps_raw_int
GpsFix.cog | GpsFix.cog_rad | GPS_RAW_INT.cog | centidegrees 0...35999, 65535 = unknown | motion.gps_raw_int
GpsFix.sog | GpsFix.sog_mps | GPS_RAW_INT.vel | cm/s, 65535 = unknown | motion.gps_raw_int
GpsFix.hdop | GpsFix.hdop | GPS_RAW_INT.eph | * 100, 65535 = unknown | motion.gps_raw_int
GpsFix.vdop | GpsFix.vdop | GPS_RAW_INT.epv | * 100, 65535 = unknown | motion.gps_raw_int
GpsFix.hacc | GpsFix.hacc_m | GPS_RAW_INT.h_acc | mm | motion.gps_raw_int
GpsFix.vacc | GpsFix.vacc_m | GPS_RAW_INT.v_acc | mm | motion.gps_raw_int
(HDT heading) | EstimatedState.psi_rad | GPS_RAW_INT.yaw | centidegrees, north = 36000, 65535 = none just now | motion.gps_raw_int
EulerAngles.phi | EstimatedState.phi_rad | ATTITUDE.roll | rad; unknown = 0, AHRS absent or not healthy | motion.attitude
EulerAngles.theta | EstimatedState.theta_rad | ATTITUDE.pitch | rad | motion.attitude
EulerAngles.psi | EstimatedState.psi_rad | ATTITUDE.yaw | rad, -pi...pi; unknown: not sent | motion.attitude
EulerAngles.time | Snapshot.t_us | ATTITUDE.time_boot_ms | ms of the monotonic clock | motion.attitude
EulerAngles.psi_magnetic | EulerAngles.psi_magnetic_rad | - | no field; in the recording only | -
EstimatedState.lat, lon + x, y | EstimatedState.lat_rad | GLOBAL_POSITION_INT.lat | degrees * 1e7 of the resolved position (IMC
    gives a reference and an offset) | motion.global_position_int
EstimatedState.lat, lon + x, y | EstimatedState.lon_rad | GLOBAL_POSITION_INT.lon | degrees * 1e7 | motion.global_position_int
EstimatedState.height | EstimatedState.height_msl_m | GLOBAL_POSITION_INT.alt | mm above mean sea level | motion.global_position_int
EstimatedState.x | EstimatedState.x_m | LOCAL_POSITION_NED.x | m north of an origin that stays for the run |
    motion.local_position_ned
EstimatedState.y | EstimatedState.y_m | LOCAL_POSITION_NED.y | m east | motion.local_position_ned
EstimatedState.z, depth | - | LOCAL_POSITION_NED.z | always 0: a surface vessel | -
EstimatedState.vx | EstimatedState.vx_mps | LOCAL_POSITION_NED.vx | m/s | motion.local_position_ned
EstimatedState.vy | EstimatedState.vy_mps | LOCAL_POSITION_NED.vy | m/s | motion.local_position_ned
EstimatedState.vx | EstimatedState.vx_mps | GLOBAL_POSITION_INT.vx | cm/s | motion.global_position_int
EstimatedState.vy | EstimatedState.vy_mps | GLOBAL_POSITION_INT.vy | cm/s | motion.global_position_int
EstimatedState.u, v | EstimatedState.sog_mps | VFR_HUD.groundspeed | m/s over ground | motion.vfr_hud
EstimatedState.psi | EstimatedState.psi_rad | GLOBAL_POSITION_INT.hdg | centidegrees, 65535 = unknown | motion.global_position_int
EstimatedState.psi | EstimatedState.psi_rad | VFR_HUD.heading | degrees | motion.vfr_hud
EstimatedState.r | EstimatedState.r_radps | ATTITUDE.yawspeed | rad/s | motion.attitude
EstimatedState.p, q | - | ATTITUDE.rollspeed | always 0: no sensor of the boat measures it | -
EstimatedState.alt | EstimatedState.alt_m | ALTITUDE.bottom_clearance | m of water under the keel, -1 = not measured (IMC: negative)
    | motion.altitude
Distance.value | Distance.value_m | DISTANCE_SENSOR.current_distance | cm below the transducer, orientation 25; not sent without a
    reading, which 0 is none; 655.35 m saturates | motion.distance_sensor
Distance.value | Distance.value_m | WATER_DEPTH.distance | m, NaN = no bottom, as also 0 is | motion.water_depth
Distance (from outside) | DistanceInput.value_m | DISTANCE_SENSOR.current_distance | in: another component's sounder, orientation 25
    | brought.distance
SetThrusterActuation.value | ActuatorOutput.thruster_port | SERVO_OUTPUT_RAW.servo1_raw | us that the board says it applied (level 0:
    commanded), 1500 + 500 v; one frame carries all four | system.servo_output_raw
SetThrusterActuation, SetServoPosition (from outside) | - | - | refused: a network peer that moves single actuators goes round
    controllers, guard and gate; MANUAL_CONTROL gives surge and yaw instead | -
SetServoPosition.value | ActuatorOutput.rudder_port_rad | SERVO_OUTPUT_RAW.servo3_raw | us, rudder limit = 500 us |
    system.servo_output_raw
DesiredHeading.value | GuidedHeading.psi_rad | SET_ATTITUDE_TARGET.q | in: yaw of the quaternion; must be repeated |
    guided.attitude_target
DesiredHeading.value | GuidedHeading.psi_rad | MAV_CMD_GUIDED_CHANGE_HEADING | in: p1 1 heading or 0 course, p2 degrees |
    table._guided_heading
DesiredHeading.value | Desired.psi_rad | NAV_CONTROLLER_OUTPUT.nav_bearing | out: degrees | motion.nav_controller_output
DesiredHeading.value | Desired.psi_rad | POSITION_TARGET_GLOBAL_INT.yaw | out: rad | motion.position_target_global_int
DesiredSpeed.value (m/s) | SetSpeed.speed_mps | MAV_CMD_DO_CHANGE_SPEED | in: p1 0 or 1, p2 m/s, -1 no change, -2 default |
    table._change_speed
DesiredSpeed.value (m/s) | SetSpeed.speed_mps | MAV_CMD_GUIDED_CHANGE_SPEED | in: p2 m/s | table._guided_speed
DesiredSpeed.value (%) | SetSpeed.throttle | MAV_CMD_DO_CHANGE_SPEED | in, as a command: p2 -1, p3 %; inside a plan it is refused,
    because a plan's legs are timed in m/s | table._change_speed
DesiredSpeed.value (%) | GuidedHeading.throttle | SET_ATTITUDE_TARGET.thrust | in: -1...1 | guided.attitude_target
DesiredSpeed.value (RPM) | - | - | refused: the boat measures no shaft speed | -
DesiredHeading + DesiredSpeed | GuidedHeading.speed_mps | SET_POSITION_TARGET_GLOBAL_INT.vx | in: velocity north and east; must be
    repeated | guided.position_target
ControlLoops.enable, mask | Snapshot.mode | HEARTBEAT.base_mode | out: modes and armed state; SYS_STATUS bits for yaw, path and
    motor control | system.heartbeat
ControlLoops (from outside) | SetMode.mode | MAV_CMD_DO_SET_MODE | in: loops follow the mode | table._set_mode
ControlLoops.scope_ref | - | - | inside only: a new leg has a new generation number | -
Abort | Arm.force | MAV_CMD_COMPONENT_ARM_DISARM | in: p1 0, p2 21196; mild stop by DO_PAUSE_CONTINUE p1 0 | table._arm
Abort (until restart) | Terminate | MAV_CMD_DO_FLIGHTTERMINATION | in: p1 1 | table._terminate
Abort (result) | Snapshot.action | HEARTBEAT.system_status | out: CRITICAL while a failsafe acts, EMERGENCY when blocked |
    system.system_status
EntityState, VehicleState | Snapshot.health | SYS_STATUS.onboard_control_sensors_health | out: one bit for each part; reasons as
    STATUSTEXT | system.sys_status
PlanControl LOAD, PlanSpecification | PlanSpecification.maneuvers | MISSION_ITEM_INT.command | in: mission upload; a list without
    graph, conditions, start and end actions | plan_mapping.compile_items
PlanControl START | StartPlan.first | MAV_CMD_MISSION_START | in: p1 first, p2 last | table._start
PlanControl STOP | PausePlan.pause | MAV_CMD_DO_PAUSE_CONTINUE | in: p1 0; IMC's stop also forgets progress: DO_SET_MISSION_CURRENT
    p1 0, p2 1 | table._pause
PlanControl GET | PlanItem | MISSION_REQUEST_LIST.mission_type | in: download | missions.MissionServer
PlanControl reply | Reply.result | MISSION_ACK.type | out, when the plan is stored | missions.MissionServer
PlanControl.plan_id | PlanSpecification.plan_id | MISSION_CURRENT.mission_id | CRC-32 of the items; IMC's names stay in files and
    logs | system.mission_current
PlanControl.flags | - | - | CALIBRATE has no meaning here, IGNORE_ERRORS is refused: checks before arming hold for all | -
PlanControlState.state | Progress.state | MISSION_CURRENT.mission_state | out; BLOCKED = PREARM health bit clear |
    system.mission_current
PlanControlState.man_id | Progress.seq | MISSION_CURRENT.seq | out; + MISSION_ITEM_REACHED | system.mission_current
PlanControlState.plan_eta, plan_progress | - | - | no field; `companion plan check` shows lengths | -
PlanControlState.last_outcome | Progress.state | MISSION_CURRENT.mission_state | COMPLETE, or a text | system.mission_current
PathControlState.y | PathControlState.cross_track_m | NAV_CONTROLLER_OUTPUT.xtrack_error | m, starboard positive |
    motion.nav_controller_output
PathControlState.x | PathControlState.distance_m | NAV_CONTROLLER_OUTPUT.wp_dist | whole m | motion.nav_controller_output
PathControlState.course_error | PathControlState.target_bearing_rad | NAV_CONTROLLER_OUTPUT.target_bearing | degrees |
    motion.nav_controller_output
StateReport (seed's state JSON) | EstimatedState.psi_rad | HIGH_LATENCY2.heading | degrees / 2; roll and pitch in custom0 (persona
    generic) and custom1 | system.high_latency2
LogBookEntry | LogText.text | STATUSTEXT.text | out, in pieces of 50 | statustext.StatusText
free JSON plan | - | - | not over MAVLink: the radio has a JSON mode of its own, and `companion plan convert` reads it | -
"""

# IMC kind | plan item | parameters
_LOITERS: Final = """
circular, duration | NAV_LOITER_TIME (19) | p1 s from reaching the circle, p2 1 = leave toward the next, p3 radius, + clockwise; NaN
    = default radius
circular, unlimited | NAV_LOITER_UNLIM (17) | p3 radius as above
circular, n turns | NAV_LOITER_TURNS (18) | p1 turns, p2, p3 as above; p3 0 is the default radius too
circular, at once | DO_ORBIT (34), also as item | p1 radius, p2 m/s, p4 radians to sail, 0 = for ever
hover | NAV_LOITER_TIME / UNLIM | p3 exactly 0: keep station
figure-eight | DO_FIGURE_EIGHT (35) | p1 length/2 + radius, + north loop clockwise; p2 radius; p3 s, 0 = for ever (ours: the
    definition leaves it empty); p4 rad from north
racetrack | WAYPOINT_USER_1 (31000), ours | p1 s, 0 = for ever; p2 length of a straight; p3 radius, + clockwise; p4 bearing of the
    straights in degrees
into wind, vehicle's choice | WAYPOINT_USER_2 (31001), ours | circle: p1 s, p2 turns, p3 radius, 0 = none given; p4 1 into the
    drift, 0 the vessel's choice
(LOITER_TO_ALT) | NAV_LOITER_TO_ALT (31) | the altitude is reached at once: sail to the circle of p2, then on
"""

# item | meaning
_ITEMS: Final = """
NAV_WAYPOINT (16) | p1 hold s, p2 acceptance radius, 0 = default; p3, p4 and altitude are not looked at
NAV_RETURN_TO_LAUNCH (20) | to the nearest rally point or home, and hold there
NAV_DELAY (93) | p1 s, or until p2:p3:p4 UTC comes next (missed by less than an hour: at once); station is kept
CONDITION_DELAY (112) | p1 s; the plan waits and station is kept
DO_JUMP (177) | p1 item (0 = first; with a home item 1 = first), p2 times, -1 for ever; loops without anything to sail are refused
DO_CHANGE_SPEED (178) | p1 0 or 1, p2 m/s, -1 no change, -2 default; a share of throttle is refused
DO_SET_HOME (179) | p1 1 = here
DO_FENCE_ENABLE (207) | p1 0 or 1
camera, gimbal, region of interest | accepted, logged, passed over
everything else | MISSION_ACK UNSUPPORTED, with the item's number and name as a text
"""


def _lines(table: str, columns: int) -> tuple[tuple[str, ...], ...]:
    """The rows of a table; an indented line goes on with the one before, and "-" is an empty cell."""
    lines = table.strip().replace("\n    ", " ").splitlines()
    rows = tuple(tuple("" if part.strip() == "-" else part.strip() for part in line.split("|")) for line in lines)
    assert all(len(row) == columns for row in rows)
    return rows


_ROOMS: Final = {
    "motion": "telemetry/motion",
    "system": "telemetry/system",
    "brought": "services/brought",
    "guided": "services/guided",
    "table": "commands/table",
    "plan_mapping": "missions/plan_mapping",
    "missions": "missions/service",
    "statustext": "telemetry/statustext",
}
"""Where a row's module lives below ``mavlink_bridge/mavlink``."""


def _row(imc: str, ours: str, mavlink: str, rule: str, code: str) -> ImcRow:
    module, _, name = code.partition(".")
    return ImcRow(imc, ours, mavlink, rule, f"mavlink/{_ROOMS[module]}.{name}" if code else "")


FIELDS: Final = tuple(_row(*line) for line in _lines(_FIELDS, 5))
LOITERS: Final = _lines(_LOITERS, 3)
ITEMS: Final = _lines(_ITEMS, 2)


def imc_table_markdown() -> str:
    """The tables of ``docs/IMC.md``."""
    parts = ["## Fields", "", "| IMC | here | MAVLink | rule | code |", "|---|---|---|---|---|"]
    for row in FIELDS:
        code = f"`mavlink_bridge/{row.code.replace('.', '.py`, `', 1)}`" if row.code else "-"
        parts.append(f"| {row.imc} | {_tick(row.ours)} | {_tick(row.mavlink)} | {row.rule} | {code} |")
    parts += ["", "## Loiters", "", "| IMC kind | plan item | parameters |", "|---|---|---|"]
    parts += [f"| {kind} | {item} | {text} |" for kind, item, text in LOITERS]
    parts += ["", "## Other plan items", "", "| item | meaning |", "|---|---|"]
    parts += [f"| {item} | {text} |" for item, text in ITEMS]
    return "\n".join(parts) + "\n"


def _tick(text: str) -> str:
    return f"`{text}`" if text else "-"
