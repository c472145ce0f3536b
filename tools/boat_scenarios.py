"""docs/BOAT-SCENARIOS.md: what the test suite of a well-known autopilot tries on its boats, and where that is tried here, or why not.

Each row names tests of this repository; a name may be the beginning of several. ``tests/unit/test_boat_table.py`` holds that they exist.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

TESTS: Final = Path(__file__).resolve().parents[1] / "tests"


@dataclass(frozen=True)
class Row:
    """One line: the scenarios' names there, the tests' names here, and what does not apply, with the reason."""

    names: str
    tests: tuple[str, ...]
    not_here: str = ""


TABLE: Final[dict[str, tuple[Row, ...]]] = {
    "Connection, parameters, messages": (
        Row("GetCapabilities", ("check_03_", "check_04_")),
        Row("Parameters", ("check_34_", "check_35_", "check_36_", "check_37_", "check_38_")),
        Row(
            "ConfigErrorLoop",
            ("every_configuration_mistake_is_named_at_once",),
            "a bad configuration does not start at all; every mistake is told with its key and the mend, exit status 2",
        ),
        Row("PARAM_ERROR", ("check_36_unknown_parameters", "check_37_a_refusal_says_why")),
        Row(
            "SET_MESSAGE_INTERVAL, MESSAGE_INTERVAL_COMMAND_INT, GetMessageInterval",
            ("rates_are_set_and_asked_for_by_both", "check_47_"),
        ),
        Row("REQUEST_MESSAGE", ("check_05_", "check_03_")),
        Row("HIGH_LATENCY2", ("the_high_latency_summary_agrees", "check_57_")),
        Row("PrivateChannel", ("twelve_links_are_served",), "no link is forwarded to another, so all are private"),
        Row(
            "SendToComponents",
            ("check_08_",),
            "the vessel is no router: what is addressed to others is left alone, neither answered nor passed on",
        ),
        Row("ManyMAVLinkConnections", ("twelve_links_are_served", "check_07_")),
        Row(
            "SYSID_ENFORCE, MAV_GCS_ENFORCE",
            ("check_67_", "row_41_only_the_owner"),
            "a system id is a claim, not a proof: signing decides who gives orders; sticks have one owner",
        ),
        Row(
            "DO_SEND_BANNER, PIDTuning",
            ("check_01_says_what_it_really_is",),
            "the banner comes by itself at the first heartbeat; the parcels of both loops are in control.csv of every run",
        ),
    ),
    "Arming and modes": (
        Row(
            "ArmFeatures",
            ("check_46_", "a_ready_vessel_may_be_armed", "whatever_is_missing_gives_neutral"),
            "no RC receiver and no arming switch",
        ),
        Row("NoArmWithoutMissionItems", ("reasons_in_every_mode", "modes_say_what_they_need")),
        Row(
            "CompassPrearms, BatteryInvalid, MissionPolyEnabledPreArm",
            (
                "a_reason_against_arming_is_told_and_goes",
                "all_reasons_come_at_once",
                "row_62_battery",
                "a_vessel_in_auto_is_not_armed_for_a_plan",
            ),
        ),
        Row("RCDuplicateOptionsExist", (), "no RC receiver"),
        Row("REQUIRE_LOCATION_FOR_ARMING", ("a_reason_against_arming_is_told_and_goes",)),
        Row("AP_ROVER_AUTO_ARM_ONCE", (), "the vessel never arms by itself: a person decides"),
        Row(
            "EStopAtBoot, SafetySwitch", ("a_stop_switch_pressed_before_the_start", "stop_switch_on_the_board_disarms")
        ),
        Row("InitialMode, RoverInitialMode", ("it_starts_disarmed_in_hold",), "not to be chosen: always Hold"),
        Row(
            "DO_SET_MODE, ChangeModeByNumber",
            ("check_49_", "check_50_", "check_51_", "check_52_"),
        ),
        Row("ModeSwitch, AuxModeSwitch", (), "no RC receiver"),
        Row(
            "MotorTest",
            ("direction_and_trim_check_names", "bench_asks_before_anything_moves"),
            "`companion bench-actuators` at the boat, with the program stopped; not over MAVLink",
        ),
        Row("CPUFailsafe", ("row_02_", "row_01_02_", "row_35_the_machine_stood_still")),
    ),
    "Manual and RC": (
        Row("DriveMaxRCIN", ("full_stick_gives_its_speed",)),
        Row(
            "DriveSquare",
            ("square_in_two_metres_of_cross_current", "legs_hold_their_lines"),
            "no waypoints saved by a switch",
        ),
        Row("RCOverrides, RCOverridesCancel", ("rc_override", "row_37_")),
        Row("MANUAL_CONTROL", ("sticks_belong_to_one_station", "row_37_the_sticks_stop", "row_42_")),
        Row("StickMixingAuto", ("sticks_do_not_move_a_plan",), "on purpose: to steer by hand is to change the mode"),
        Row("SlewRate", ("row_20_",)),
        Row("DriveBrake", ("the_brake_shortens_the_way",)),
        Row("SkidSteer", ("yaw_alone_turns_the_boat_where_it_lies",)),
        Row(
            "ServoRelayEvents",
            ("a_survey_with_camera_items_is_sailed",),
            "no spare outputs: items for servos and relays are refused, those for cameras noted and passed over",
        ),
    ),
    "Missions": (
        Row(
            "DriveMission, DriveEachFrame",
            ("a_plan_in_every_frame", "a_survey_with_camera_items_is_sailed", "check_44_"),
        ),
        Row(
            "GCSMission, MissionRetransfer, ClearMission, MissionFrames",
            ("check_13_", "check_14_", "check_15_", "check_17_", "check_18_", "check_23_", "check_24_"),
        ),
        Row(
            "MAV_CMD_MISSION_START, DO_SET_MISSION_CURRENT",
            ("check_26_", "set_current_and_a_last_item", "switching_and_loading"),
        ),
        Row("EndMissionBehavior", ("a_finished_mission_is_complete",), "not to be chosen: the vessel keeps station"),
        Row(
            "DO_CHANGE_SPEED, NAV_RETURN_TO_LAUNCH",
            ("check_22_", "check_53_", "return_goes_to_the_nearest_rally_point"),
        ),
        Row("DO_SET_REVERSE", (), "refused: the vessel brakes astern but does not sail astern"),
        Row(
            "DriveRTL, RTL_SPEED, SmartRTL",
            ("the_return_keeps_its_own_speed", "a_return_does_not_cross_the_fence"),
            "no SmartRTL: the way back is straight, and held by fence and depth guard",
        ),
        Row("SetHome, GET_HOME_POSITION", ("a_home_that_was_moved",)),
    ),
    "Guided": (
        Row(
            "SetpointGlobalPos, SetpointGlobalVel, SET_POSITION_TARGET_LOCAL_NED",
            ("guided_positions_and_velocities", "absurd_set_points_are_ignored", "row_38_"),
        ),
        Row("SET_ATTITUDE_TARGET", ("attitude_set_points_steer", "absurd_attitudes_are_ignored", "row_38_")),
        Row(
            "NAV_SET_YAW_SPEED, Offboard", (), "refused as plan items: a plan does not hand the helm to another program"
        ),
    ),
    "Safety": (
        Row(
            "GCSFailsafe",
            (
                "row_36_",
                "ground_loss_by_parameters",
                "the_actions_on_ground_loss_are_limited",
                "a_station_that_comes_back_finds",
            ),
        ),
        Row("ThrottleFailsafe", ("row_37_",)),
        Row(
            "GCSFence, FenceFullAndPartialTransfer, GCSFenceInvalidPoint, SDPolyFence",
            ("check_29_", "check_12_", "check_18_"),
        ),
        Row(
            "PolyFence, DO_FENCE_ENABLE",
            ("row_60_nothing_crosses", "check_31_", "check_33_", "a_plan_that_leads_out_is_taken"),
        ),
        Row(
            "PolyFenceAvoidance, PolyFenceObjectAvoidance, AC_Avoidance, AP_Proximity_MAV",
            ("a_plan_that_passes_an_exclusion_is_held",),
            "the vessel stops before an area; it does not look for a way round, and has no proximity sensors",
        ),
        Row("Rally, GCSRally, RallyUploadDownload", ("check_32_",)),
        Row(
            "BATTERY_RESET",
            (),
            "the battery is what the actuator board measures; nothing is counted that could be reset",
        ),
        Row("JammingSimulation", ("row_21_", "row_22_", "row_23_", "row_24_")),
    ),
    "Sensors, logs": (
        Row(
            "DepthFinder",
            ("check_54_", "row_61_depth_below", "another_components_sounder"),
            "one sounder, downward; no forward-looking one",
        ),
        Row("RangeFinder", ("depth_from_another_component_counts_too",)),
        Row(
            "Button, OpticalFlow, WheelEncoders, AccelCal",
            (),
            "no such sensors on this boat; attitude comes from the GNSS compass",
        ),
        Row(
            "Logging, DataFlash, DataFlashOverMAVLink, LoggerDocumentation",
            ("a_log_comes_whole", "a_log_over_a_bad_link", "an_armed_boat_keeps_its_logs"),
            "telemetry log and recorded inputs, documented in [RECORDINGS.md](RECORDINGS.md); no DataFlash blocks are streamed",
        ),
    ),
    "Missing there, held here": (
        Row(
            "cross-track, orbit radius and step response, with limits",
            ("legs_hold_their_lines", "circle_is_joined_and_held", "rtk_class_circle_in_truth"),
        ),
        Row(
            "wind and current", ("legs_in_wind_and_current", "hold_in_wind_and_current", "water_faster_than_the_vessel")
        ),
        Row("depth guard", ("row_61_", "by_force_it_stops_before_the_contour", "ten_hours_at_4_15_m")),
        Row("station keeping", ("hover_faces_the_drift", "hold_in_wind_and_current")),
        Row("orbit asked for by a station", ("check_45_", "circle_of_10_m_by_orbit")),
        Row("rudder failure", ("a_rudder_that_sticks",)),
        Row("a LoRa-class radio", ("through_the_gateway", "plain_on_the_shore_modems_port")),
        Row(
            "start-up and transfer times", ("check_06_", "829_items_take_well_under", "qgc_like_client_over_real_links")
        ),
    ),
}


def test_names() -> frozenset[str]:
    """Names of all tests, without ``test_``."""
    found: set[str] = set()
    for path in TESTS.rglob("test_*.py"):
        found.update(re.findall(r"^def test_(\w+)", path.read_text(encoding="utf-8"), flags=re.MULTILINE))
    return frozenset(found)


def page() -> str:
    """The page."""
    lines = [
        "# Scenarios for boats",
        "",
        "ArduPilot's test suite has the longest list of things to try on a MAVLink boat. This is that list, and for each line the tests",
        "that try it here (a name stands for all tests that begin so), or the reason why it does not apply. Written by `make docs`.",
        "",
    ]
    for group, rows in TABLE.items():
        lines += [f"## {group}", "", "| scenario | tests here | what differs, and why |", "| --- | --- | --- |"]
        for row in rows:
            tests = "<br>".join(f"`{name}`" for name in row.tests)
            lines.append(f"| {row.names} | {tests} | {row.not_here} |")
        lines.append("")
    return "\n".join(lines)
