"""The manoeuvres of a plan, those that are refused included: a plan must be read whole to be refused by name.

A field whose unit is told by another field (speed, with speed_units) has none in its name. Depth is positive down.
"""

from __future__ import annotations

from typing import ClassVar

from ..fields import F32, F64, U8, U16, ListOf, Message, Text, message


@message
class Goto(Message):
    NUMBER: ClassVar[int] = 450
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    roll_rad: F64 = 0.0
    pitch_rad: F64 = 0.0
    yaw_rad: F64 = 0.0
    custom: Text = ""


@message
class Teleoperation(Message):
    NUMBER: ClassVar[int] = 452
    custom: Text = ""
    """``src=16385``: the console that holds the sticks."""


@message
class Loiter(Message):
    NUMBER: ClassVar[int] = 453
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    duration_s: U16 = 0
    """0: for ever."""
    speed: F32 = 0.0
    speed_units: U8 = 0
    type: U8 = 0
    """A ``LoiterType``."""
    radius_m: F32 = 0.0
    length_m: F32 = 0.0
    bearing_rad: F64 = 0.0
    direction: U8 = 0
    """A ``Direction``."""
    custom: Text = ""


@message
class Rows(Message):
    """Parallel tracks over a rectangle."""

    NUMBER: ClassVar[int] = 456
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    bearing_rad: F64 = 0.0
    cross_angle_rad: F64 = 0.0
    width_m: F32 = 0.0
    length_m: F32 = 0.0
    hstep_m: F32 = 0.0
    coff_m: U8 = 0
    alternation_pct: U8 = 0
    flags: U8 = 0
    """``RowsFlags``."""
    custom: Text = ""


@message
class PathPoint(Message):
    """North, east and down from the manoeuvre's own position."""

    NUMBER: ClassVar[int] = 458
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0


@message
class FollowPath(Message):
    NUMBER: ClassVar[int] = 457
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    points: ListOf[PathPoint] = ()
    custom: Text = ""


@message
class YoYo(Message):
    NUMBER: ClassVar[int] = 459
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    amplitude_m: F32 = 0.0
    pitch_rad: F32 = 0.0
    speed: F32 = 0.0
    speed_units: U8 = 0
    custom: Text = ""


@message
class TeleoperationDone(Message):
    NUMBER: ClassVar[int] = 460


@message
class StationKeeping(Message):
    NUMBER: ClassVar[int] = 461
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    radius_m: F32 = 0.0
    duration_s: U16 = 0
    """0: for ever."""
    speed: F32 = 0.0
    speed_units: U8 = 0
    custom: Text = ""


@message
class TrajectoryPoint(Message):
    NUMBER: ClassVar[int] = 464
    x_m: F32 = 0.0
    y_m: F32 = 0.0
    z_m: F32 = 0.0
    t_s: F32 = 0.0


@message
class FollowTrajectory(Message):
    NUMBER: ClassVar[int] = 463
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    points: ListOf[TrajectoryPoint] = ()
    custom: Text = ""


@message
class CommsRelay(Message):
    NUMBER: ClassVar[int] = 472
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    speed: F32 = 0.0
    speed_units: U8 = 0
    duration_s: U16 = 0
    sys_a: U16 = 0
    sys_b: U16 = 0
    move_threshold_m: F32 = 0.0


@message
class CompassCalibration(Message):
    NUMBER: ClassVar[int] = 475
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    pitch_rad: F32 = 0.0
    amplitude_m: F32 = 0.0
    duration_s: U16 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    radius_m: F32 = 0.0
    direction: U8 = 0
    custom: Text = ""


@message
class Launch(Message):
    NUMBER: ClassVar[int] = 485
    timeout_s: U16 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    custom: Text = ""


@message
class RowsCoverage(Message):
    NUMBER: ClassVar[int] = 488
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    bearing_rad: F64 = 0.0
    cross_angle_rad: F64 = 0.0
    width_m: F32 = 0.0
    length_m: F32 = 0.0
    coff_m: U8 = 0
    aperture_rad: F32 = 0.0
    """IMC's angAperture."""
    range_m: U16 = 0
    overlap_pct: U8 = 0
    flags: U8 = 0
    custom: Text = ""


@message
class FollowPoint(Message):
    NUMBER: ClassVar[int] = 494
    target: Text = ""
    max_speed: F32 = 0.0
    speed_units: U8 = 0
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    custom: Text = ""


@message
class StationKeepingExtended(Message):
    """StationKeeping; with ``KEEP_SAFE`` an underwater vehicle waits below and comes up now and then."""

    NUMBER: ClassVar[int] = 496
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    z_m: F32 = 0.0
    z_units: U8 = 0
    radius_m: F32 = 0.0
    duration_s: U16 = 0
    speed: F32 = 0.0
    speed_units: U8 = 0
    popup_period_s: U16 = 0
    popup_duration_s: U16 = 0
    flags: U8 = 0
    """``KeepFlags``."""
    custom: Text = ""
