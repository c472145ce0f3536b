"""The table from the original's five DUNE tasks to this program: task parameter, message and test, each with its new home.

A test holds every entry: a key must exist in the schema, a parameter in the table, a module and a test on disk.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Task:
    """One task of the original and what does its work here."""

    name: str
    became: str
    modules: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter of a task. ``key`` is the TOML key; the MAVLink parameter is looked up."""

    task: str
    name: str
    default: str
    key: str
    note: str = ""


@dataclass(frozen=True, slots=True)
class Message:
    """One message that a task took or gave."""

    name: str
    here: str
    mavlink: str


@dataclass(frozen=True, slots=True)
class Trial:
    """One test that the original describes. ``test``: path::name."""

    task: str
    what: str
    test: str


TASKS = (
    Task(
        "LT1000",
        "NMEA 0183 in from any talker; position, attitude and depth with validity and age",
        ("companion/core/nmea/reader.py", "companion/core/estimate/estimator.py"),
    ),
    Task(
        "UART_Comm",
        "actuator line with checksums, status and a watchdog on the board; the seed's bare letters on request",
        ("companion/core/board/arduino.py", "companion/core/board/wire.py", "companion/core/board/actuator_map.py"),
    ),
    Task(
        "Lora_serial",
        "MAVLink, a compact authenticated link, or the seed's JSON over the radio, under an airtime ledger",
        ("mavlink_bridge/radio/aboard.py", "mavlink_bridge/radio/json_radio.py", "mavlink_bridge/radio/air/ledger.py"),
    ),
    Task(
        "SimpleHeadingAndSpeed",
        'two loops and a mix; `profile = "seed"` keeps the original law, the default follows the hull\'s physics',
        ("companion/core/steer/seed.py", "companion/core/steer/model.py", "companion/core/guide/guidance.py"),
    ),
    Task(
        "MinAltitude",
        "depth guard with the original's margins, an explicit *unknown*, and a stop that looks ahead",
        ("companion/core/guard/depth/guard.py", "companion/core/guard/failsafe.py"),
    ),
)

SETTINGS = (
    Setting("LT1000", "Serial Port - Device", "tcp://127.0.0.1:3000", "sensors.url", "`/dev/ttyS0` is understood too"),
    Setting("LT1000", "Serial Port - Baud Rate", "115200", "sensors.baud", "or `?baud=` in the address"),
    Setting(
        "LT1000", "Sentence Order", "GPZDA, GPGGA, GPRMC, GPVTG, GPHDT", "sensors.nmea.sentences", "names or formatters"
    ),
    Setting("UART_Comm", "Target Producer", "Producer", "steering.profile", "there is one producer: the gate"),
    Setting("UART_Comm", "Serial Port - Device", "/dev/ttyACM0", "actuators.url"),
    Setting(
        "UART_Comm", "Serial Port - Baud Rate", "112500", "actuators.baud", "115200 here: 112500 is no standard rate"
    ),
    Setting(
        "UART_Comm", "Message Frequency", "1.0", "actuators.board.frequency_hz", "20 here; every actuator, every time"
    ),
    Setting("UART_Comm", "Actuation Lower Bound", "1000", "actuators.board.lower_us"),
    Setting("UART_Comm", "Actuation Upper Bound", "2000", "actuators.board.upper_us"),
    Setting("Lora_serial", "Entity Label", "Producer2", "system.entity_label"),
    Setting("Lora_serial", "Serial Port - Device", "/dev/ttyS0", "radio.url"),
    Setting("Lora_serial", "Serial Port - Baud Rate", "9600", "radio.url", "`?baud=9600`; parity and stop bits too"),
    Setting("SimpleHeadingAndSpeed", "Maximum Thruster Output", "1.0", "steering.seed.max_thruster_output"),
    Setting("SimpleHeadingAndSpeed", "Maximum Thruster Differential", "0.2", "steering.seed.max_thruster_differential"),
    Setting("SimpleHeadingAndSpeed", "Maximum Thruster Rate", "0.0", "steering.seed.max_thruster_rate"),
    Setting("SimpleHeadingAndSpeed", "Low Speed Thruster Percentage", "0.2", "steering.seed.low_speed_thruster_share"),
    Setting(
        "SimpleHeadingAndSpeed", "High Speed Thruster Percentage", "0.8", "steering.seed.high_speed_thruster_share"
    ),
    Setting("SimpleHeadingAndSpeed", "High Speed Threshold", "1.0 (knots)", "steering.seed.high_speed_threshold_kn"),
    Setting("SimpleHeadingAndSpeed", "High Speed Hysteresis", "0.1 (knots)", "steering.seed.high_speed_hysteresis_kn"),
    Setting(
        "SimpleHeadingAndSpeed",
        "Speed PID Gains",
        "none",
        "steering.seed.speed_gains",
        "required by the profile, as there; live as `SEED_SPD_P`, `_I`, `_D`, `_IMAX`",
    ),
    Setting(
        "SimpleHeadingAndSpeed",
        "Heading PID Gains",
        "none",
        "steering.seed.heading_gains",
        "required by the profile; live as `SEED_HDG_P`, `_I`, `_D`, `_IMAX`",
    ),
    Setting("MinAltitude", "Minimum Acceptable Altitude", "4.0", "depth.min_altitude_m"),
    Setting("MinAltitude", "Minimum Altitude Margin", "0.1", "depth.minimum_margin_m"),
    Setting("MinAltitude", "Good Altitude Margin", "0.1", "depth.good_margin_m"),
)

MESSAGES = (
    Message("GpsFix", "`imc.GpsFix`", "GPS_RAW_INT, SYSTEM_TIME"),
    Message("EulerAngles", "`imc.EulerAngles`", "ATTITUDE"),
    Message("EstimatedState", "`imc.EstimatedState`", "GLOBAL_POSITION_INT, LOCAL_POSITION_NED, VFR_HUD, WATER_DEPTH"),
    Message("SetThrusterActuation", "`imc.ActuatorOutput`", "SERVO_OUTPUT_RAW"),
    Message("SetServoPosition", "`imc.ActuatorOutput`", "SERVO_OUTPUT_RAW"),
    Message("DesiredHeading", "`imc.Desired`, `requests.GuidedHeading`", "GUIDED_CHANGE_HEADING, SET_ATTITUDE_TARGET"),
    Message("DesiredSpeed", "`imc.Desired`, `requests.SetSpeed`", "DO_CHANGE_SPEED, GUIDED_CHANGE_SPEED"),
    Message("ControlLoops", "modes and arming: `imc.Mode`, `requests.Arm`", "DO_SET_MODE, COMPONENT_ARM_DISARM"),
    Message(
        "Abort",
        "`requests.Arm(arm=False, force=True)`, `requests.Terminate`",
        "COMPONENT_ARM_DISARM 21196, DO_FLIGHTTERMINATION",
    ),
    Message(
        "PlanControl, PlanSpecification",
        "`requests.LoadPlan`, `requests.StartPlan`",
        "the mission protocol, MISSION_START",
    ),
    Message("Loiter", "`imc.Loiter`", "NAV_LOITER_TIME, _TURNS, _UNLIM, DO_ORBIT, DO_FIGURE_EIGHT"),
    Message(
        "char* Plan (JSON)",
        "`mavlink_bridge/plans/seed_json.py`",
        "the mission protocol; the JSON itself over the radio",
    ),
    Message(
        "char* State (JSON)", "`mavlink_bridge/plans/seed_json.py`", "HIGH_LATENCY2; the JSON itself over the radio"
    ),
)

TRIALS = (
    Trial(
        "LT1000",
        "NMEA messages are received, decoded and turned into messages of the system",
        "tests/unit/test_nmea_sentences.py::test_the_seeds_epoch_gives_position_speed_time_and_attitude",
    ),
    Trial(
        "UART_Comm", "Value_Generator: ramps over all four actuators", "tests/scenario/test_actuators_in_the_loop.py::"
    ),
    Trial(
        "Lora_serial", "plan in and state out over a terminal program (socat)", "tests/unit/test_planfile_formats.py::"
    ),
    Trial(
        "SimpleHeadingAndSpeed",
        "the unit scenario: 90° at 3 knots, then -90° at 5 knots",
        "tests/unit/test_steering_seed.py::test_the_seeds_unit_scenario",
    ),
    Trial(
        "SimpleHeadingAndSpeed",
        "integration: go-to manoeuvres in a simulator",
        "tests/scenario/test_control_closed_loop.py::",
    ),
    Trial(
        "MinAltitude",
        "unit 1: acceptable, in the correction band, too low",
        "tests/unit/test_depth_guard.py::test_seed_sequence_1_into_correction_then_locked",
    ),
    Trial(
        "MinAltitude",
        "unit 2: acceptable, then far too low",
        "tests/unit/test_depth_guard.py::test_seed_sequence_2_straight_into_locked",
    ),
    Trial(
        "MinAltitude",
        "unit 3: far too low at the start",
        "tests/unit/test_depth_guard.py::test_seed_sequence_3_locked_at_the_first_reading",
    ),
    Trial(
        "MinAltitude",
        "unit 4: a correction that succeeds",
        "tests/unit/test_depth_guard.py::test_seed_sequence_4_a_correction_that_succeeds",
    ),
    Trial(
        "MinAltitude",
        "integration: turn back out of the shallow",
        "tests/unit/test_depth_guard.py::test_seed_integration_turning_back_returns_to_normal",
    ),
    Trial(
        "MinAltitude",
        "integration: press on into it",
        "tests/unit/test_depth_guard.py::test_seed_integration_pressing_on_ends_locked_without_correction",
    ),
)

NOT_SPOKEN = (
    (
        "Neptus",
        "QGroundControl: *Plan* draws and uploads, *Fly* arms, starts, holds (mode menu), shows texts; the radio looks the same to it",
    ),
    ("IMC on the wire", "MAVLink 2; [IMC.md](IMC.md) has every field. Inside, the messages keep their IMC names"),
    ("LSF logs and MRA", "a `.tlog` that every MAVLink tool reads, CSV files, and `companion report`"),
    ("DUNE's profiles and `.ini` files", "one TOML file; `companion check` explains it"),
    ("Plan graphs with conditions", "a MAVLink mission: a list with jumps, delays and speeds"),
    ("Value_Generator, Waypoints, socat", "`companion bench-actuators`, the simulator, and `pty:` links"),
)


def settings_rows(parameters: dict[str, str]) -> list[str]:
    """Markdown rows of the parameters; ``parameters`` maps TOML keys to MAVLink names."""
    rows = []
    for item in SETTINGS:
        name = parameters.get(item.key, "")
        rows.append(
            f"| {item.task} | {item.name} | {item.default} | `{item.key}` | {f'`{name}`' if name else ''} | {item.note} |"
        )
    return rows


def page(parameters: dict[str, str]) -> str:
    """docs/FROM-DUNE.md."""
    parts = [
        "# From DUNE",
        "",
        "For people who know the five tasks of the original installation: where each thing went.",
        "",
        "## Tasks",
        "",
        "| task | here | modules |",
        "| --- | --- | --- |",
        *(f"| {task.name} | {task.became} | {', '.join(f'`{path}`' for path in task.modules)} |" for task in TASKS),
        "",
        "## Parameters",
        "",
        "| task | parameter | its default | TOML key | MAVLink parameter | note |",
        "| --- | --- | --- | --- | --- | --- |",
        *settings_rows(parameters),
        "",
        "## Messages",
        "",
        "| IMC | inside | MAVLink |",
        "| --- | --- | --- |",
        *(f"| {item.name} | {item.here} | {item.mavlink} |" for item in MESSAGES),
        "",
        "## Tests",
        "",
        "| task | what it tried | here |",
        "| --- | --- | --- |",
        *(f"| {item.task} | {item.what} | `{item.test.rstrip(':')}` |" for item in TRIALS),
        "",
        "The original swapped the results of its two integration tests of MinAltitude; the table gives each with the result that its",
        "own rules lead to.",
        "",
        "## What is not spoken, and what to use",
        "",
        "| there | here |",
        "| --- | --- |",
        *(f"| {there} | {here} |" for there, here in NOT_SPOKEN),
    ]
    return "\n".join(parts) + "\n"
