"""The numbers that fields stand for, each written beside its meaning (IMC 5.4.31, the message's own table).

A message's field is a plain int, because anything may come from the wire; these are compared with it.
"""

from __future__ import annotations

from enum import IntEnum, IntFlag


class SystemType(IntEnum):
    """What a system is (Announce)."""

    CCU = 0
    HUMANSENSOR = 1
    UUV = 2
    USV = 3
    UAV = 4
    UGV = 5
    STATICSENSOR = 6
    MOBILESENSOR = 7
    WSN = 8


class EntityCondition(IntEnum):
    """EntityState.state."""

    BOOT = 0
    NORMAL = 1
    FAULT = 2
    ERROR = 3
    FAILURE = 4


class EntityListOp(IntEnum):
    """EntityList.op."""

    REPORT = 0
    QUERY = 1
    RELOAD = 2


class LogBookType(IntEnum):
    """LogBookEntry.type."""

    INFO = 0
    WARNING = 1
    ERROR = 2
    CRITICAL = 3
    DEBUG = 4


class LogBookCommand(IntEnum):
    """LogBookControl.command."""

    GET = 0
    CLEAR = 1
    GET_ERR = 2
    REPLY = 3


class LoggingOp(IntEnum):
    """LoggingControl.op."""

    REQUEST_START = 0
    STARTED = 1
    REQUEST_STOP = 2
    STOPPED = 3
    REQUEST_CURRENT_NAME = 4
    CURRENT_NAME = 5


class FixKind(IntEnum):
    """GpsFix.type."""

    STANDALONE = 0
    DIFFERENTIAL = 1
    DEAD_RECKONING = 2
    MANUAL_INPUT = 3
    SIMULATION = 4


class FixValidity(IntFlag):
    """GpsFix.validity."""

    DATE = 0x0001
    TIME = 0x0002
    POSITION = 0x0004
    COURSE = 0x0008
    SPEED = 0x0010
    HACC = 0x0020
    VACC = 0x0040
    HDOP = 0x0080
    VDOP = 0x0100


class DistanceValidity(IntEnum):
    """Distance.validity."""

    INVALID = 0
    VALID = 1


class ZUnits(IntEnum):
    """How a manoeuvre's z is meant."""

    NONE = 0
    DEPTH = 1
    ALTITUDE = 2
    HEIGHT = 3


class SpeedUnits(IntEnum):
    """How a manoeuvre's speed is meant."""

    METERS_PS = 0
    RPM = 1
    PERCENTAGE = 2


class LoiterType(IntEnum):
    """Loiter.type."""

    DEFAULT = 0
    CIRCULAR = 1
    RACETRACK = 2
    EIGHT = 3
    HOVER = 4


class Direction(IntEnum):
    """Which way round (Loiter, CompassCalibration): vehicle's choice, clockwise, the other way, into wind or current."""

    VDEP = 0
    CLOCKW = 1
    CCLOCKW = 2
    IWINDCURR = 3


class RowsFlags(IntFlag):
    """Rows.flags, RowsCoverage.flags."""

    SQUARE_CURVE = 0x01
    CURVE_RIGHT = 0x02


class KeepFlags(IntFlag):
    """StationKeepingExtended.flags."""

    KEEP_SAFE = 0x01


class PathFlags(IntFlag):
    """PathControlState.flags; of DesiredPath only the last three mean the same."""

    NEAR = 0x01
    LOITERING = 0x02
    NO_Z = 0x04
    PATH_3D = 0x08
    CCLOCKW = 0x10


class ManeuverProgress(IntEnum):
    """ManeuverControlState.state."""

    EXECUTING = 0
    DONE = 1
    ERROR = 2
    STOPPED = 3


class OpMode(IntEnum):
    """VehicleState.op_mode."""

    SERVICE = 0
    CALIBRATION = 1
    ERROR = 2
    MANEUVER = 3
    EXTERNAL = 4
    BOOT = 5


class VehicleFlags(IntFlag):
    """VehicleState.flags."""

    MANEUVER_DONE = 0x01


class ControlLoops(IntFlag):
    """VehicleState.control_loops."""

    PATH = 0x0000_0001
    TELEOPERATION = 0x0000_0002
    ALTITUDE = 0x0000_0004
    DEPTH = 0x0000_0008
    ROLL = 0x0000_0010
    PITCH = 0x0000_0020
    YAW = 0x0000_0040
    SPEED = 0x0000_0080
    YAW_RATE = 0x0000_0100
    VERTICAL_RATE = 0x0000_0200
    TORQUE = 0x0000_0400
    FORCE = 0x0000_0800
    VELOCITY = 0x0000_1000
    THROTTLE = 0x0000_2000
    EXTERNAL = 0x4000_0000
    NO_OVERRIDE = 0x8000_0000


class LimitsMask(IntFlag):
    """OperationalLimits.mask."""

    MAX_DEPTH = 0x01
    MIN_ALT = 0x02
    MAX_ALT = 0x04
    MIN_SPEED = 0x08
    MAX_SPEED = 0x10
    MAX_VRATE = 0x20
    AREA = 0x40


class VariableType(IntEnum):
    """PlanVariable.type."""

    BOOLEAN = 0
    NUMBER = 1
    TEXT = 2
    MESSAGE = 3


class VariableAccess(IntEnum):
    """PlanVariable.access."""

    INPUT = 0
    OUTPUT = 1
    LOCAL = 2


class ReplyType(IntEnum):
    """PlanDB.type and PlanControl.type."""

    REQUEST = 0
    SUCCESS = 1
    FAILURE = 2
    IN_PROGRESS = 3


class PlanDBOp(IntEnum):
    """PlanDB.op."""

    SET = 0
    DEL = 1
    GET = 2
    GET_INFO = 3
    CLEAR = 4
    GET_STATE = 5
    GET_DSTATE = 6
    BOOT = 7


class PlanControlOp(IntEnum):
    """PlanControl.op."""

    START = 0
    STOP = 1
    LOAD = 2
    GET = 3


class PlanFlags(IntFlag):
    """PlanControl.flags."""

    CALIBRATE = 0x0001
    IGNORE_ERRORS = 0x0002


class PlanState(IntEnum):
    """PlanControlState.state."""

    BLOCKED = 0
    READY = 1
    INITIALIZING = 2
    EXECUTING = 3


class Outcome(IntEnum):
    """PlanControlState.last_outcome."""

    NONE = 0
    SUCCESS = 1
    FAILURE = 2


class StatisticsType(IntEnum):
    """PlanStatistics.type."""

    PREPLAN = 0
    INPLAN = 1
    POSTPLAN = 2


class StatisticsProperties(IntFlag):
    """PlanStatistics.properties."""

    NONLINEAR = 0x01
    INFINITE = 0x02
    CYCLICAL = 0x04


class RemoteActionsOp(IntEnum):
    """RemoteActionsRequest.op."""

    REPORT = 0
    QUERY = 1
    REGISTER = 2


class LblOp(IntEnum):
    """LblConfig.op."""

    SET_CFG = 0
    GET_CFG = 1
    CUR_CFG = 2


class Activation(IntEnum):
    """EntityActivationState.state."""

    INACTIVE = 0
    ACTIVE = 1
    ACT_IP = 2
    ACT_DONE = 3
    ACT_FAIL = 4
    DEACT_IP = 5
    DEACT_DONE = 6
    DEACT_FAIL = 7
