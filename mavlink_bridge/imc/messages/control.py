"""Messages about who drives and how: remote control, the vehicle's mode, its limits, the emergency stop."""

from __future__ import annotations

from typing import ClassVar

from ..fields import F32, F64, U8, U16, U32, Message, Text, message


@message
class RemoteActionsRequest(Message):
    """Which axes and buttons a vehicle has: ``Thrust=Axis;Stop=Button``."""

    NUMBER: ClassVar[int] = 304
    op: U8 = 0
    """A ``RemoteActionsOp``."""
    actions: Text = ""


@message
class RemoteActions(Message):
    """Where the sticks are: ``Thrust=64;Heading=-12``, axes -127...127, buttons 0 or 1."""

    NUMBER: ClassVar[int] = 305
    actions: Text = ""


@message
class ManeuverControlState(Message):
    NUMBER: ClassVar[int] = 470
    state: U8 = 0
    """A ``ManeuverProgress``."""
    eta_s: U16 = 0xFFFF
    """0xFFFF unknown."""
    info: Text = ""


@message
class VehicleState(Message):
    """The mode that a console shows; without it a system counts as not connected."""

    NUMBER: ClassVar[int] = 500
    op_mode: U8 = 0
    """An ``OpMode``."""
    error_count: U8 = 0
    error_ents: Text = ""
    """Labels with commas between."""
    maneuver_type: U16 = 0xFFFF
    """Number of the manoeuvre's message; 0xFFFF outside manoeuvres, or the console goes on showing the last one."""
    maneuver_stime_s: F64 = -1.0
    """When the manoeuvre began: UTC, s since 1970."""
    maneuver_eta_s: U16 = 0xFFFF
    """0xFFFF unknown."""
    control_loops: U32 = 0
    """``ControlLoops``."""
    flags: U8 = 0
    """``VehicleFlags``."""
    last_error: Text = ""
    last_error_time_s: F64 = -1.0
    """UTC, s since 1970; -1 none."""


@message
class OperationalLimits(Message):
    """What the vehicle may not do; ``mask`` says which fields mean anything."""

    NUMBER: ClassVar[int] = 504
    mask: U8 = 0
    """``LimitsMask``."""
    max_depth_m: F32 = 0.0
    min_altitude_m: F32 = 0.0
    max_altitude_m: F32 = 0.0
    min_speed_mps: F32 = 0.0
    max_speed_mps: F32 = 0.0
    max_vrate_mps: F32 = 0.0
    lat_rad: F64 = 0.0
    """Of the centre of the area."""
    lon_rad: F64 = 0.0
    orientation_rad: F32 = 0.0
    """Of the area's length, from north."""
    width_m: F32 = 0.0
    length_m: F32 = 0.0


@message
class GetOperationalLimits(Message):
    NUMBER: ClassVar[int] = 505


@message
class Abort(Message):
    """Stop, whatever runs. Sent once; nothing is answered."""

    NUMBER: ClassVar[int] = 550
