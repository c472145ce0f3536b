"""IMC's manoeuvres in our own language: each becomes what sails it, or is refused with the reason. Nothing becomes something like it.

A surface vessel has no depth and no altitude: z must be 0, or of no unit. Speeds are m/s, or a share of the full speed that the
configuration names; a shaft speed is refused. ``timeout`` is not enforced, as in the original installation; a plan has its own
monitors. Sources: imc-wire §6 and §11, dune-imc §2.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge import imc
from mavlink_bridge.language import messages as ours
from mavlink_bridge.language.figures import Circle, Figure, FigureEight, Hover, LoiterDirection, Racetrack
from mavlink_bridge.language.geodesy import direct

from .patterns import CoverageField, Point, rows
from .refusal import ConsoleRefusedError

MOST_POINTS: Final = 800
"""About what a vehicle has room for; the vehicle's own limit is told by itself."""
_FARTHEST_M: Final = 100_000.0
_FASTEST_MPS: Final = 50.0
_QUARTER: Final = 0.5 * math.pi
_DIRECTIONS: Final = {
    imc.Direction.VDEP: LoiterDirection.VESSEL,
    imc.Direction.CLOCKW: LoiterDirection.CW,
    imc.Direction.CCLOCKW: LoiterDirection.CCW,
    imc.Direction.IWINDCURR: LoiterDirection.INTO_DRIFT,
}


@dataclass(frozen=True, slots=True)
class Sailed:
    """What a manoeuvre becomes. ``notes``: what of it means nothing here, in words."""

    maneuvers: tuple[ours.Goto | ours.Loiter, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Means:
    """What is known of the vessel."""

    full_speed_mps: float | None = None
    """What 100 % is; None: not known."""


def sailed(maneuver: imc.Message | None, means: Means) -> Sailed:
    """Read one manoeuvre. Raises ConsoleRefusedError with the reason."""
    if maneuver is None:
        raise ConsoleRefusedError("there is no manoeuvre in it")
    reader = _READERS.get(type(maneuver))
    if reader is None:
        number = maneuver.number if isinstance(maneuver, imc.UnknownMessage) else maneuver.NUMBER
        raise ConsoleRefusedError(f"{imc.name_of(number)} is not one of this vessel's manoeuvres")
    return reader(maneuver, means)


# Fields


def _place(maneuver: Any) -> tuple[float, float]:
    lat_rad, lon_rad = maneuver.lat_rad, maneuver.lon_rad
    fits = math.isfinite(lat_rad) and math.isfinite(lon_rad) and abs(lat_rad) <= _QUARTER and abs(lon_rad) <= math.pi
    if not fits:
        raise ConsoleRefusedError("its position is not on the globe")
    if lat_rad == 0.0 and lon_rad == 0.0:
        raise ConsoleRefusedError("its position 0, 0 means not set")
    return lat_rad, lon_rad


def _surface(z_m: float, units: int) -> None:
    """Raises ConsoleRefusedError for what only a diving or flying vehicle can hold."""
    if units == imc.ZUnits.NONE or (z_m == 0.0 and units in (imc.ZUnits.DEPTH, imc.ZUnits.HEIGHT)):
        return
    name = imc.ZUnits(units).name.lower() if units in imc.ZUnits.__members__.values() else f"z of unit {units}"
    raise ConsoleRefusedError(f"{name} {z_m:g} m: a surface vessel keeps the surface (set z to 0, depth)")


def _speed(maneuver: Any, means: Means) -> float:
    speed: float = maneuver.speed
    units: int = maneuver.speed_units
    match units:
        case imc.SpeedUnits.METERS_PS:
            speed_mps = speed
        case imc.SpeedUnits.PERCENTAGE:
            if means.full_speed_mps is None:
                raise ConsoleRefusedError(
                    f"speed {speed:g} %: the full speed is not known here (full_speed_mps); use m/s"
                )
            speed_mps = 0.01 * speed * means.full_speed_mps
        case imc.SpeedUnits.RPM:
            raise ConsoleRefusedError(f"speed {speed:g} RPM: no shaft speed is measured; use m/s")
        case _:
            raise ConsoleRefusedError(f"speed of unit {units} is not known")
    if not 0.0 < speed_mps <= _FASTEST_MPS:
        raise ConsoleRefusedError(f"speed {speed_mps:g} m/s is not above 0 and up to {_FASTEST_MPS:g}")
    return speed_mps


def _length(value_m: float, what: str) -> float:
    if not 0.0 < value_m <= _FARTHEST_M:
        raise ConsoleRefusedError(f"{what} {value_m:g} m is not above 0 and up to {_FARTHEST_M:g}")
    return value_m


def _angle(value_rad: float, what: str) -> float:
    if not math.isfinite(value_rad) or abs(value_rad) > 4.0 * math.pi:
        raise ConsoleRefusedError(f"{what} {value_rad:g} rad is no direction")
    return math.remainder(value_rad, math.tau)


# Manoeuvres


def _goto(maneuver: imc.Goto, means: Means) -> Sailed:
    lat_rad, lon_rad = _place(maneuver)
    _surface(maneuver.z_m, maneuver.z_units)
    return Sailed((ours.Goto(0, lat_rad, lon_rad, speed_mps=_speed(maneuver, means)),))


def _loiter(maneuver: imc.Loiter, means: Means) -> Sailed:
    lat_rad, lon_rad = _place(maneuver)
    _surface(maneuver.z_m, maneuver.z_units)
    speed_mps = _speed(maneuver, means)
    figure = _figure(maneuver)
    duration_s = float(maneuver.duration_s) if maneuver.duration_s else None
    return Sailed((ours.Loiter(0, lat_rad, lon_rad, figure=figure, duration_s=duration_s, speed_mps=speed_mps),))


def _figure(loiter: imc.Loiter) -> Figure:
    match loiter.type:
        case imc.LoiterType.DEFAULT | imc.LoiterType.CIRCULAR:
            return Circle(radius_m=_length(loiter.radius_m, "radius"), direction=_direction(loiter))
        case imc.LoiterType.RACETRACK:
            return Racetrack(
                length_m=_length(loiter.length_m, "length"),
                radius_m=_length(loiter.radius_m, "radius"),
                bearing_rad=_axis_rad(loiter),
                direction=_either_way(loiter, "racetrack"),
            )
        case imc.LoiterType.EIGHT:
            return FigureEight(
                length_m=_length(loiter.length_m, "length"),
                radius_m=_length(loiter.radius_m, "radius"),
                bearing_rad=_axis_rad(loiter),
                direction=_either_way(loiter, "figure-eight"),
            )
        case imc.LoiterType.HOVER:
            return Hover()
        case _:
            raise ConsoleRefusedError(f"loiter type {loiter.type} is not known")


def _direction(loiter: imc.Loiter) -> LoiterDirection:
    found = _DIRECTIONS.get(imc.Direction(loiter.direction)) if loiter.direction in _DIRECTIONS else None
    if found is None:
        raise ConsoleRefusedError(f"loiter direction {loiter.direction} is not known")
    return found


def _either_way(loiter: imc.Loiter, what: str) -> LoiterDirection:
    """For figures whose direction has to be said: the vessel's choice is clockwise."""
    direction = _direction(loiter)
    if direction is LoiterDirection.INTO_DRIFT:
        raise ConsoleRefusedError(f"a {what} goes clockwise or counter-clockwise, not into wind or current")
    return LoiterDirection.CW if direction is LoiterDirection.VESSEL else direction


def _axis_rad(loiter: imc.Loiter) -> float:
    """The consoles draw IMC's bearing of a figure from east, counter-clockwise; ours is from north, clockwise."""
    return math.remainder(0.5 * math.pi - _angle(loiter.bearing_rad, "bearing"), math.tau)


def _station_keeping(maneuver: imc.StationKeeping | imc.StationKeepingExtended, means: Means) -> Sailed:
    lat_rad, lon_rad = _place(maneuver)
    _surface(maneuver.z_m, maneuver.z_units)
    speed_mps = _speed(maneuver, means)
    duration_s = float(maneuver.duration_s) if maneuver.duration_s else None
    held = ours.Loiter(0, lat_rad, lon_rad, figure=Hover(), duration_s=duration_s, speed_mps=speed_mps)
    notes: tuple[str, ...] = ()
    if isinstance(maneuver, imc.StationKeepingExtended) and maneuver.flags & imc.KeepFlags.KEEP_SAFE:
        notes = ("waiting under water and coming up is for divers: it stays at the surface",)
    return Sailed((held,), notes)


def _follow_path(maneuver: imc.FollowPath, means: Means) -> Sailed:
    lat_rad, lon_rad = _place(maneuver)
    _surface(maneuver.z_m, maneuver.z_units)
    speed_mps = _speed(maneuver, means)
    if not maneuver.points:
        raise ConsoleRefusedError("its path has no points")
    for point in maneuver.points:
        _surface(point.z_m, imc.ZUnits.DEPTH if maneuver.z_units else imc.ZUnits.NONE)
    return _track((lat_rad, lon_rad), [(point.x_m, point.y_m) for point in maneuver.points], speed_mps)


def _rows(maneuver: imc.Rows, means: Means) -> Sailed:
    start = _place(maneuver)
    _surface(maneuver.z_m, maneuver.z_units)
    if maneuver.alternation_pct > 100:
        raise ConsoleRefusedError(f"alternation {maneuver.alternation_pct} % is above 100")
    field = CoverageField(
        bearing_rad=_angle(maneuver.bearing_rad, "bearing"),
        cross_angle_rad=_angle(maneuver.cross_angle_rad, "cross angle"),
        width_m=_length(maneuver.width_m, "width"),
        length_m=_length(maneuver.length_m, "length"),
        hstep_m=_length(maneuver.hstep_m, "horizontal step"),
        overshoot_m=float(maneuver.coff_m),
        alternation=maneuver.alternation_pct / 100.0,
        square=bool(maneuver.flags & imc.RowsFlags.SQUARE_CURVE),
        right=bool(maneuver.flags & imc.RowsFlags.CURVE_RIGHT),
    )
    if 2 * field.count > MOST_POINTS:
        raise ConsoleRefusedError(f"{field.count} rows: {MOST_POINTS // 2} fit")
    return _track(start, rows(field), _speed(maneuver, means))


def _track(start: Point, points: list[Point], speed_mps: float) -> Sailed:
    """Points north and east of a place, m, as points to sail to one after the other."""
    if len(points) > MOST_POINTS:
        raise ConsoleRefusedError(f"{len(points)} points: {MOST_POINTS} fit")
    gotos = []
    for north_m, east_m in points:
        distance_m = math.hypot(north_m, east_m)
        if not distance_m <= _FARTHEST_M:
            raise ConsoleRefusedError(f"a point lies {distance_m:g} m away: {_FARTHEST_M:g} is the most")
        lat_rad, lon_rad = direct(*start, math.atan2(east_m, north_m), distance_m)
        gotos.append(ours.Goto(0, lat_rad, lon_rad, speed_mps=speed_mps))
    return Sailed(tuple(gotos))


_READERS: Final[dict[type[imc.Message], Callable[[Any, Means], Sailed]]] = {
    imc.Goto: _goto,
    imc.Loiter: _loiter,
    imc.StationKeeping: _station_keeping,
    imc.StationKeepingExtended: _station_keeping,
    imc.FollowPath: _follow_path,
    imc.Rows: _rows,
}
