"""Keys and parameters of the first release that live elsewhere now: one table for old settings files, stores and recordings.

A fact has one home: the hull file owns geometry, ``system`` owns time, ``failsafe`` owns time-outs. An old file is told
the new place of each key; an old recording is carried over key by key, and what cannot be is named.
"""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class Move:
    """One key's way. Keys are dotted, ``*`` stands for a place in a list."""

    old: str
    new: str
    """Key in the hull file, or in the settings."""
    hull: bool = True
    """``new`` is in the hull file."""
    acted: bool = True
    """The first release sailed by the old key; otherwise the new one acted there too, and keeps its recorded value."""
    parameter: str = ""
    """The MAVLink parameter that it was."""


MOVES: Final = (
    Move("depth.input.keel_depth_m", "keel_depth_m", parameter="KEEL_DEPTH"),
    Move("depth.input.transducer_depth_m", "transducer_depth_m", parameter="SNDR_DEPTH"),
    Move("sensors.*.nmea.keel_depth_m", "keel_depth_m", acted=False),
    Move("sensors.*.nmea.transducer_depth_m", "transducer_depth_m", acted=False),
    Move("depth.beam_m", "hull.beam_m"),
    Move("estimate.antenna_forward_m", "antenna.forward_m", parameter="EST_ANT_X"),
    Move("estimate.antenna_starboard_m", "antenna.starboard_m", parameter="EST_ANT_Y"),
    Move("estimate.antenna_up_m", "antenna.up_m", parameter="EST_ANT_UP"),
    Move("gate.rudder_max_deg", "rudder.max_deg", parameter="GATE_RUD_MAX"),
    Move("actuators.board.rudder_max_deg", "rudder.max_deg", acted=False, parameter="ACT_RUD_MAX"),
    Move("monitors.rudder_max_deg", "rudder.max_deg", acted=False),
    Move("gate.control_period_s", "system.tick_hz", hull=False, acted=False),
    Move("monitors.control_period_s", "system.tick_hz", hull=False, acted=False),
    Move("modes.manual_timeout_s", "failsafe.manual_timeout_s", hull=False, acted=False, parameter="MANUAL_TIMEOUT"),
    Move("modes.guided_timeout_s", "failsafe.guided_timeout_s", hull=False, acted=False, parameter="GUIDED_TIMEOUT"),
    Move("world.sensors.transducer_depth_m", "transducer_depth_m"),
    Move("world.sensors.antenna_forward_m", "antenna.forward_m"),
    Move("world.sensors.antenna_starboard_m", "antenna.starboard_m"),
    Move("world.sensors.antenna_up_m", "antenna.up_m"),
)

GONE: Final = {
    "actuators.board.allow_level0": "is no more: a board that does not answer is not sailed with (docs/ACTUATORS.md)",
}
"""Keys without a new place, and why."""
ELSEWHERE: Final = {
    "world": "is the simulator's: a boat has the water that there is, 'companion sim --config FILE --set world.KEY=VALUE' rehearses",
}
"""Keys of another file, and whose."""
GONE_PARAMETERS: Final = {"ACT_LEVEL0_OK": GONE["actuators.board.allow_level0"]}

_PARAMETERS: Final = {move.parameter: move for move in MOVES if move.parameter}


def told(key: str, value: Any) -> str:
    """Where a key of an old settings file lives now and what to do; nothing when it never was a key."""
    if key in GONE or key in ELSEWHERE:
        return f"{(GONE | ELSEWHERE)[key]}; remove it"
    move = next((move for move in MOVES if fnmatch.fnmatchcase(key, move.old)), None)
    if move is None:
        return ""
    what = f"{move.new} = {_as_new(move, value)}"
    if move.new == "system.tick_hz":
        return f"follows from system.tick_hz now; remove it (for this period: {what})"
    if not move.hull:
        return f"is one with {move.new} now; remove it, or write {what}"
    own = ", or in a table [mounts.NAME] of this sensor's own" if key.startswith("sensors.") else ""
    return f"belongs to the hull file now; write {what} into the file that 'vessel' names{own}, and remove it here"


def parameter_told(name: str, value: float) -> str:
    """The same for a parameter that a store or a station names; nothing when it never was one."""
    move = _PARAMETERS.get(name)
    if name in GONE_PARAMETERS:
        return f"{name} {GONE_PARAMETERS[name]}"
    if move is None:
        return ""
    place = "the hull file's" if move.hull else "the setting"
    return f"{name} = {value:g} counts no more: {place} {move.new} does"


def carry_over(settings: dict[str, Any], vessel: dict[str, Any]) -> list[str]:
    """Move what an old recording has under old keys to where this program looks, in place; return what gave way to what.

    ``settings`` and ``vessel`` are as recorded. The value that the first release sailed by wins.
    """
    gave_way, settled = [], set()
    for key in GONE:
        list(_taken(settings, key.split(".")))
    for move in MOVES:
        for key, value in _taken(settings, move.old.split(".")):
            place, name = _place(vessel if move.hull else settings, move.new)
            wanted = _as_new(move, value)
            if move.acted and move.new not in settled and not move.old.startswith("world."):
                if move.new == "rudder.max_deg" and place.get(name, wanted) != wanted:
                    gave_way.append(f"the hull's {move.new} = {place[name]:g} gave way to {key} = {value:g}")
                place[name] = wanted
                settled.add(move.new)
            elif name in place and place[name] != wanted and not _never_acted(key, wanted, place[name]):
                gave_way.append(f"{key} = {value:g} gave way to {move.new} = {place[name]:g}")
    return gave_way


def _never_acted(key: str, wanted: float, kept: float) -> bool:
    """The simulator's keys say nothing of the vessel's process; a longer time-out never came to act beside a shorter."""
    return key.startswith("world.") or (key.startswith("modes.") and wanted > kept)


def _as_new(move: Move, value: Any) -> Any:
    if move.new == "system.tick_hz" and isinstance(value, float | int) and value > 0:
        return round(1.0 / value)
    return value


def _taken(data: Any, path: list[str], before: str = "") -> Iterator[tuple[str, Any]]:
    """Take every value of a pattern out of nested data, each with its key."""
    step, rest = path[0], path[1:]
    names: list[Any] = list(range(len(data))) if step == "*" and isinstance(data, list) else [step]
    for name in names:
        here = f"{before}{name}"
        if (isinstance(data, dict) and name not in data) or not isinstance(data, dict | list):
            continue
        if rest:
            yield from _taken(data[name], rest, f"{here}.")
        elif isinstance(data, dict):
            yield here, data.pop(name)


def _place(data: dict[str, Any], key: str) -> tuple[dict[str, Any], str]:
    *tables, name = key.split(".")
    for table in tables:
        data = data.setdefault(table, {})
    return data, name
