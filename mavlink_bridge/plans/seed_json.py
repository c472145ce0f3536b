"""The loiter plan of the original installation as JSON: one object, or a list of them, for example

``{"id": "loiter-1", "latitude": 41.185, "longitude": -8.706, "duration_s": 600, "loiter_type": "circular",
"speed_kn": 3, "length_m": 40, "radius_m": 20}``

The original's own labels ("Loiter type", "Speed") and short keys are accepted too. Speeds are knots, bearings degrees from
north, durations count from reaching the path and 0 is unlimited.
Nothing is guessed: an unknown type, key or a value out of range is refused.
Source: dune-imc §4.2.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.language.units import KNOT_MPS

from ..language.figures import FIGURES, Circle, Figure, FigureEight, Hover, LoiterDirection, Racetrack, figure_of
from ..language.messages import Loiter
from ..mavlink.missions.plan_rules import DEFAULT_LIMITS, PlanLimits

MAX_BYTES: Final = 65_536
_KEYS: Final = {
    "id": ("id",),
    "latitude": ("latitude", "lat"),
    "longitude": ("longitude", "lon"),
    "duration": ("duration_s", "duration", "dur"),
    "type": ("loiter_type", "type"),
    "speed": ("speed_kn", "speed", "spd"),
    "length": ("length_m", "length", "len"),
    "radius": ("radius_m", "radius", "rad"),
    "direction": ("direction", "dir"),
    "bearing": ("bearing_deg", "bearing"),
    "version": ("v", "version"),
}
_NAMES: Final = {name: key for key, names in _KEYS.items() for name in names}
_KINDS: Final[dict[str, type[Figure]]] = {
    **{name.replace("-", ""): figure for name, figure in FIGURES.items()},
    "eight": FigureEight,
    "ltcircular": Circle,
    "ltracetrack": Racetrack,
    "lthover": Hover,
    "lteight": FigureEight,
}
"""A type's name in plain letters, the original installation's own spellings included."""
_DIRECTIONS: Final = {"cw": LoiterDirection.CW, "ccw": LoiterDirection.CCW}
_MISSING: Final = object()


class SeedJsonError(ValueError):
    """Why a JSON plan is refused: one sentence."""


@dataclass(frozen=True, slots=True)
class SeedPlan:
    """A named loiter."""

    name: str
    loiter: Loiter


def read_json(data: bytes | str) -> Any:
    """Parse JSON strictly: UTF-8, no duplicate keys, no NaN or Infinity, bounded nesting. Raises SeedJsonError."""
    try:
        text = data.decode("utf-8") if isinstance(data, bytes) else data
        return json.loads(text, object_pairs_hook=_unique, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        if isinstance(error, SeedJsonError):
            raise
        raise SeedJsonError(f"not JSON: {type(error).__name__}: {str(error)[:120]}") from None


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise SeedJsonError(f"key {key[:40]!r} stands twice")
        result[key] = value
    return result


def _refuse_constant(name: str) -> Any:
    raise SeedJsonError(f"{name} is not a number")


def parse(data: bytes | str, limits: PlanLimits = DEFAULT_LIMITS) -> tuple[SeedPlan, ...]:
    """The loiters of a JSON plan, in order; their ``seq`` counts from 0. Raises SeedJsonError."""
    if len(data) > MAX_BYTES:
        raise SeedJsonError(f"{len(data)} bytes, {MAX_BYTES} fit")
    found = read_json(data)
    entries = found if isinstance(found, list) else [found]
    if not entries or len(entries) > limits.max_items:
        raise SeedJsonError(f"{len(entries)} plans, 1 to {limits.max_items} fit")
    return tuple(_plan(seq, entry, limits) for seq, entry in enumerate(entries))


def _plan(seq: int, entry: Any, limits: PlanLimits) -> SeedPlan:
    fields = _fields(entry)
    name = fields.get("id")
    if not isinstance(name, str) or not 1 <= len(name) <= 64 or not name.isprintable():
        raise SeedJsonError("id must be a text of 1 to 64 characters")
    kind = _kind(fields.get("type"))
    duration = _number(fields, "duration", 0.0, min(65_535.0, limits.max_duration_s), 0.0)
    radius = _number(fields, "radius", 0.0, limits.max_length_m, 0.0)
    length = _number(fields, "length", 0.0, limits.max_length_m, 0.0)
    speed_kn = _number(fields, "speed", 0.0, limits.max_speed_mps / KNOT_MPS, None)
    if speed_kn == 0.0:
        raise SeedJsonError("speed 0 would never get there")
    if kind in (Racetrack, FigureEight) and not (length and radius):
        raise SeedJsonError(f"{kind.name} needs length and radius")
    if kind is FigureEight and length < 2.0 * radius:
        raise SeedJsonError(f"length {length:g} m is below twice the radius {radius:g} m")
    loiter = Loiter(
        seq,
        math.radians(_number(fields, "latitude", -90.0, 90.0)),
        math.radians(_number(fields, "longitude", -180.0, 180.0)),
        figure=figure_of(
            kind.name,
            radius_m=radius or None,
            length_m=length,
            bearing_rad=math.radians(_number(fields, "bearing", 0.0, 360.0)) if "bearing" in fields else None,
            direction=_direction(fields.get("direction", "cw")),
        ),
        duration_s=duration or None,
        speed_mps=speed_kn * KNOT_MPS,
    )
    return SeedPlan(name, loiter)


def _fields(entry: Any) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise SeedJsonError("a plan must be an object with id, latitude, longitude, duration, type, speed")
    fields: dict[str, Any] = {}
    for label, value in entry.items():
        key = _NAMES.get(label.strip().lower().replace(" ", "_"))
        if key is None:
            raise SeedJsonError(f"key {label[:40]!r} is unknown")
        if key in fields:
            raise SeedJsonError(f"{key} is given twice")
        fields[key] = value
    if fields.get("version", 1) != 1:
        raise SeedJsonError("only version 1 is known")
    return fields


def _number(fields: dict[str, Any], key: str, low: float, high: float, default: Any = _MISSING) -> float:
    value = fields.get(key, default)
    if value is _MISSING or value is None:
        raise SeedJsonError(f"{key} is missing")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SeedJsonError(f"{key} must be a number")
    if not low <= value <= high:
        raise SeedJsonError(f"{key} {value:g} is outside {low:g} to {high:g}")
    return float(value)


def _kind(value: Any) -> type[Figure]:
    plain = "".join(letter for letter in value.lower() if letter.isalnum()) if isinstance(value, str) else ""
    kind = _KINDS.get(plain)
    if kind is None:
        raise SeedJsonError(f"loiter type {str(value)[:40]!r} is none of {', '.join(FIGURES)}")
    return kind


def _direction(value: Any) -> LoiterDirection:
    direction = _DIRECTIONS.get(value.lower()) if isinstance(value, str) else None
    if direction is None:
        raise SeedJsonError("direction must be cw or ccw")
    return direction


def write(name: str, loiter: Loiter, speed_mps: float | None = None) -> str:
    """One loiter in the long keys, compact. ``speed_mps`` stands in for a loiter without its own speed.

    Raises SeedJsonError for what the format cannot say: turns, a direction chosen aboard, no speed.
    """
    speed = loiter.speed_mps if loiter.speed_mps is not None else speed_mps
    figure = loiter.figure
    said = {key: getattr(figure, key, None) for key in ("radius_m", "length_m", "bearing_rad")}
    direction = LoiterDirection.CW if isinstance(figure, Hover) else figure.direction
    if loiter.turns is not None or direction not in _DIRECTIONS.values() or speed is None:
        raise SeedJsonError("the format has no turns and no direction chosen aboard, and needs a speed")
    entry: dict[str, Any] = {
        "id": name,
        "latitude": round(math.degrees(loiter.lat_rad), 7),
        "longitude": round(math.degrees(loiter.lon_rad), 7),
        "duration_s": loiter.duration_s or 0,
        "loiter_type": figure.name,
        "speed_kn": round(speed / KNOT_MPS, 3),
        "length_m": said["length_m"] or 0,
        "radius_m": said["radius_m"] or 0,
    }
    if direction is LoiterDirection.CCW:
        entry["direction"] = "ccw"
    if said["bearing_rad"] is not None:
        entry["bearing_deg"] = round(math.degrees(said["bearing_rad"]) % 360.0, 2)
    return json.dumps(entry, separators=(",", ":"))
