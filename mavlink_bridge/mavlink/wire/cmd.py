"""MAV_CMD: the numbers of commands, written down once. What each means is told by ``commands`` (now) and ``missions`` (in a plan).

A plain command (``language.spoken``) is not here: its request names it, and the dialect knows the number.

The radio's code tables (``radio/codec/wire.py``) hold numbers of their own: they are frozen with the radio's format.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class Cmd(IntEnum):
    """By the dialect's names, those of plan items without NAV_."""

    WAYPOINT = 16
    LOITER_UNLIM = 17
    LOITER_TURNS = 18
    LOITER_TIME = 19
    RETURN_TO_LAUNCH = 20
    LOITER_TO_ALT = 31
    DO_ORBIT = 34
    DO_FIGURE_EIGHT = 35
    NAV_DELAY = 93
    CONDITION_DELAY = 112
    CONDITION_YAW = 115
    DO_SET_MODE = 176
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_FLIGHTTERMINATION = 185
    DO_REPOSITION = 192
    DO_PAUSE_CONTINUE = 193
    DO_FENCE_ENABLE = 207
    DO_SET_MISSION_CURRENT = 224
    PREFLIGHT_STORAGE = 245
    PREFLIGHT_REBOOT_SHUTDOWN = 246
    DO_SET_STANDARD_MODE = 262
    MISSION_START = 300
    COMPONENT_ARM_DISARM = 400
    GET_HOME_POSITION = 410
    GET_MESSAGE_INTERVAL = 510
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_PROTOCOL_VERSION = 519
    REQUEST_AUTOPILOT_CAPABILITIES = 520
    CONTROL_HIGH_LATENCY = 2600
    FENCE_RETURN_POINT = 5000
    FENCE_POLYGON_INCLUSION = 5001
    FENCE_POLYGON_EXCLUSION = 5002
    FENCE_CIRCLE_INCLUSION = 5003
    FENCE_CIRCLE_EXCLUSION = 5004
    RALLY_POINT = 5100
    RACETRACK = 31000
    """MAV_CMD_WAYPOINT_USER_1, our racetrack."""
    LOITER_CHOICE = 31001
    """MAV_CMD_WAYPOINT_USER_2, our loiter whose direction the vessel chooses."""
    SEA_TRIAL = 31012
    """MAV_CMD_USER_3: begins, confirms or ends a sea trial."""
    REQUEST_OPERATOR_CONTROL = 32100
    """Passes command from one station to another; newer than the pinned dialect."""
    GUIDED_CHANGE_SPEED = 43000
    GUIDED_CHANGE_HEADING = 43002


CAMERA_AND_GIMBAL: Final = frozenset(
    {195, 196, 197, 198, 200, 201, 202, 203, 204, 205, 206, 214, 530, 531, 532, 534, 1000, 1001, 2000, 2001, 2003}
    | {2500, 2501, 2502, 2503, 2800, 2801}
)
"""Camera, gimbal and region-of-interest commands: this boat has none of them."""
