"""The panel: a picture as lines that fit a terminal, what matters first, the newest alarms always among them."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Final, NamedTuple

from ...status.others import PERSON, headline, where
from ...status.picture import LinkSeen, Picture, ToldText

_NONE: Final = "–"
_LABEL: Final = 11
TEXTS_AT_LEAST: Final = 5
"""Lines of texts that no row may take away."""
_SENTENCE_LINES: Final = 3
"""Lines that one failsafe's sentence may take: the longest of the table in 80 columns."""
_ALARMS: Final = frozenset({"EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING"})
_RED: Final = frozenset({"EMERGENCY", "ALERT", "CRITICAL", "ERROR"})
_GUARD_COLOURS: Final = {"ok": "green", "correction": "yellow", "locked": "red", "off": "red"}
_RISKS_SHOWN: Final = 3
_ALARMS_KEPT: Final = 3
"""The newest alarms stay in sight however many other texts come after them."""


class PanelLine(NamedTuple):
    """One line of the screen: a label, a text, a colour ("" = the terminal's own)."""

    label: str
    text: str
    colour: str = ""


def panel(p: Picture, width: int = 80, height: int = 24) -> list[PanelLine]:
    """Return at most ``height`` lines of at most ``width`` columns."""
    urgent = _head(p) + _failsafes(p, width)
    room = height - len(urgent)
    texts = _texts(p, width, max(TEXTS_AT_LEAST, min(room // 3, len(p.texts))))
    rows = _rows(p, width)[: max(0, room - len(texts))]
    rows += _links(p, max(0, room - len(texts) - len(rows)))
    return [_cut(each, width) for each in [*urgent, *rows, *texts][:height]]


def _head(p: Picture) -> list[PanelLine]:
    colour = "red" if p.action not in ("NONE", "WARN") else "green" if p.armed else "yellow"
    found = [
        PanelLine(_time(p.t_s), f"{p.mode}, {'armed' if p.armed else 'disarmed'}", colour),
        PanelLine("Now", p.now, colour),
    ]
    return found + [PanelLine("Next" if not number else "", text, "yellow") for number, text in enumerate(p.next[:3])]


def _failsafes(p: Picture, width: int) -> list[PanelLine]:
    if not p.failsafes:
        return [PanelLine("Failsafe", "none", "green")]
    found = []
    for number, each in enumerate(p.failsafes):
        colour = "yellow" if each.doing in ("", "warning", "taken over") else "red"
        lines = textwrap.wrap(each.sentence, width - _LABEL - 1, max_lines=_SENTENCE_LINES, placeholder=" …")
        if number >= 2:  # the first two in full; of the rest that they are there
            lines = lines[:1]
        found += [PanelLine("" if place or number else "Failsafe", text, colour) for place, text in enumerate(lines)]
    return found[:8]


def _rows(p: Picture, width: int) -> list[PanelLine]:
    """What fits of these is shown, from the top."""
    lost = "" if p.lat_deg is not None else "red"
    found = []
    if p.not_ready:
        lines = textwrap.wrap("; ".join(p.not_ready), width - _LABEL - 1, max_lines=2, placeholder=" …")
        found += [PanelLine("" if place else "Not ready", text, "yellow") for place, text in enumerate(lines)]
    found += [
        PanelLine("Position", f"{position(p)}   {p.receiver}", lost),
        PanelLine("Motion", _motion(p), "" if p.heading_deg is not None else "red"),
        PanelLine("Depth", _depth(p), _GUARD_COLOURS.get(p.guard, "")),
        *_traffic(p),
        PanelLine("Plan", _plan(p), "green" if p.plan == "active" else ""),
        PanelLine("Actuators", _actuators(p), "" if p.actuators_ok else "red"),
    ]
    found += [_link(link) for link in p.links if link.is_missing]
    found.append(PanelLine("Errors", _errors(p)))
    if p.fence_on:
        found.append(PanelLine("Fence", f"{_number(p.fence_m, 'm', 0)} to the nearest edge"))
    if p.airtime:
        found.append(PanelLine("Airtime", p.airtime))
    return found


def _traffic(p: Picture) -> list[PanelLine]:
    """Persons, and each vessel with risk and what we owe her; without any, how many there are and the nearest."""
    risks = [each for each in p.others if each.sentence][:_RISKS_SHOWN]
    if risks:
        colours = ["red" if each.danger == "close" or each.kind == PERSON else "yellow" for each in risks]
        lines = [headline(each) for each in risks]
        return [
            PanelLine("" if n else "Traffic", text, colour)
            for n, (text, colour) in enumerate(zip(lines, colours, strict=True))
        ]
    if not p.others_known:
        return []
    nearest = min(p.others, key=lambda each: math.inf if each.range_m is None else each.range_m, default=None)
    rest = "none near" if nearest is None else f"nearest {nearest.title}, {where(nearest)}"
    return [PanelLine("Traffic", f"{p.others_known} known, {rest}")]


def _links(p: Picture, room: int) -> list[PanelLine]:
    """Each link where there is room, else one line for all."""
    rest = [link for link in p.links if not link.is_missing]
    if not rest or room <= 0:
        return []
    if len(rest) <= room:
        return [_link(link) for link in rest]
    is_open = [link.name for link in rest if link.is_open]
    return [PanelLine("Links", f"{len(is_open)} of {len(p.links)} open: {', '.join(is_open)}")]


def _texts(p: Picture, width: int, count: int) -> list[PanelLine]:
    """The newest texts in so many lines, the newest alarms among them and in full."""
    chosen = {each.number for each in p.texts[-count:]}
    alarms = [each for each in p.texts if each.severity in _ALARMS][-_ALARMS_KEPT:]
    for alarm in alarms:
        if alarm.number not in chosen:
            oldest = next(each for each in p.texts if each.number in chosen and each not in alarms)
            chosen.remove(oldest.number)
            chosen.add(alarm.number)
    shown = [(each, _text(each, width)) for each in p.texts if each.number in chosen]
    while len(shown) > 1 and sum(len(lines) for _, lines in shown) > count:
        shown.remove(next((pair for pair in shown if pair[0] not in alarms), shown[0]))
    return [each for _, lines in shown for each in lines]


def _text(told: ToldText, width: int) -> list[PanelLine]:
    """An alarm in up to two lines, any other text in one."""
    if told.severity not in _ALARMS:
        return [PanelLine(_time(told.t_s), told.text, "dim")]
    colour = "red" if told.severity in _RED else "yellow"
    text = f"{told.severity}: {told.text}"
    lines = textwrap.wrap(text, width - _LABEL - 1, max_lines=2, placeholder=" …")
    return [PanelLine("" if place else _time(told.t_s), each, colour) for place, each in enumerate(lines)]


def line(p: Picture) -> str:
    """The state in one line."""
    parts = [
        _time(p.t_s),
        f"{p.mode}{'' if p.armed else ' (disarmed)'}",
        position(p),
        f"hdg {_number(p.heading_deg, '°', 0, space='')}",
        _number(p.speed_mps, "m/s", 2),
        p.at_item or "no plan",
        f"xte {_number(p.cross_track_m, 'm', 2)}",
        f"water {_number(p.keel_m, 'm', 1)}",
    ]
    if p.failsafes:
        parts.append(f"{p.action}: {'. '.join(each.sentence for each in p.failsafes)}")
    parts += [f"traffic: {each.sentence}" for each in p.others if each.sentence][:1]
    parts += [f"next: {text}" for text in p.next if text.startswith("STOPS in ")]
    if p.not_ready:
        parts.append(f"not ready: {'; '.join(p.not_ready)}")
    return "  ".join(parts)


def position(p: Picture) -> str:
    """Latitude and longitude, or that they are not known."""
    if p.lat_deg is None or p.lon_deg is None:
        return "no position"
    return f"{p.lat_deg:.6f}° {p.lon_deg:.6f}°"


def _motion(p: Picture) -> str:
    heading, course = _compass(p.heading_deg), _compass(p.course_deg)
    return f"heading {heading}, course {course}, speed {_number(p.speed_mps, 'm/s', 2)}"


def _depth(p: Picture) -> str:
    limit, stop = _number(p.keel_limit_m, "m", 1), _number(p.keel_stop_m, "m", 1)
    now = "" if p.keel_limit_m is None or p.keel_stop_m is None or stop == limit else f" (stopped at {stop} now)"
    return f"{_number(p.keel_m, 'm', 1)} under the keel, limit {limit}{now}, guard {_guard(p)}"


def _guard(p: Picture) -> str:
    return "OFF: no shoal stops her" if p.guard == "off" else p.guard


def _plan(p: Picture) -> str:
    if not p.items:
        return "none"
    to_go = "" if p.to_go_m is None else f", {_number(p.to_go_m, 'm', 0)} to go"
    return f"{p.plan}, {p.at_item}{to_go}"


def _actuators(p: Picture) -> str:
    battery = "" if p.battery_v is None else f", battery {p.battery_v:.1f} V"
    port, starboard = p.rudders_deg
    return f"thrust {p.thrust[0]:+.2f} {p.thrust[1]:+.2f}, rudders {port:.0f}° {starboard:.0f}°, {p.output}{battery}"


def _errors(p: Picture) -> str:
    heading = _number(p.heading_error_deg, "°", 1, space="")
    return f"cross-track {_number(p.cross_track_m, 'm', 2)}, heading {heading}, speed {_number(p.speed_error_mps, 'm/s', 2)}"


def _link(link: LinkSeen) -> PanelLine:
    age = _NONE if link.age_s is None else f"{link.age_s:.1f} s ago"
    text = f"{link.text or link.kind}, in {_bytes(link.bytes_in)} ({age}), out {_bytes(link.bytes_out)}"
    return PanelLine(link.name[:_LABEL], text, "green" if link.is_open else "red" if link.is_missing else "dim")


def _bytes(count: int) -> str:
    return (
        f"{count} B" if count < 10_000 else f"{count / 1000:.0f} kB" if count < 10_000_000 else f"{count / 1e6:.0f} MB"
    )


def _number(value: float | None, unit: str, digits: int, *, space: str = " ") -> str:
    return _NONE if value is None else f"{value:.{digits}f}{space}{unit}"


def _compass(value_deg: float | None) -> str:
    return _NONE if value_deg is None else f"{round(value_deg) % 360:03d}°"


def _time(t_s: float) -> str:
    seconds = int(t_s)
    return f"{seconds // 3600}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"


def _cut(each: PanelLine, width: int) -> PanelLine:
    room = width - _LABEL - 1
    return each if len(each.text) <= room else each._replace(text=each.text[: room - 1] + "…")


_COLOURS: Final = {"red": "31;1", "yellow": "33", "green": "32", "dim": "2", "": "0"}


def coloured(lines: Sequence[PanelLine]) -> list[str]:
    """Lines for a terminal (ECMA-48 colours)."""
    return [f"\x1b[2m{each.label:<{_LABEL}}\x1b[0m \x1b[{_COLOURS[each.colour]}m{each.text}\x1b[0m" for each in lines]
