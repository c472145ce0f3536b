"""A page of encounters: the tally, and the ten worst as pictures from above with what was told of each vessel and when."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import Final

from companion.report.page import document

from .many import lines, tally_of, worst_of
from .sets import Encounter
from .verdict import EncounterVerdict
from .watch import TRACK_S, EncounterOutcome, ToldVessel, sail

_SIDE: Final = 460.0
_OURS: Final = "#0969da"
_COLOURS: Final = ("#cf222e", "#9a6700", "#8250df", "#1a7f37", "#bc4c00")
_ROUND_M: Final = (50.0, 100.0, 200.0, 500.0)
_LEGEND: Final = (
    "Blue: we, straight on. Numbers stand where a vessel begins, an arrow where she goes; filled dots: where both were when she was "
    "nearest; rings: where both were when she was told."
)
Point = tuple[float, float]
"""North and east, m."""


def make_page(title: str, verdicts: Sequence[EncounterVerdict], encounters: Sequence[Encounter]) -> str:
    """One HTML file: the tally, and the ten worst sailed again for their pictures."""
    by_name = {each.name: each for each in encounters}
    body = [f"<h1>Encounters {html.escape(title)}</h1>"]
    body += [f"<p>{html.escape(line)}</p>" for line in lines(tally_of(verdicts))]
    body.append(f"<p class=soft>{_LEGEND}</p>")
    body += [_section(verdict, sail(by_name[verdict.name])) for verdict in worst_of(verdicts)]
    return document(f"Encounters {title}", "".join(body))


def _section(verdict: EncounterVerdict, outcome: EncounterOutcome) -> str:
    name = html.escape(verdict.name)
    rows = "".join(_row(number, each, outcome) for number, each in enumerate(outcome.told))
    head = "<tr><th>Vessel<th>Length, speed<th>Nearest<th>Told<th>By the truth</tr>"
    again = f"companion sim --encounters {name}"
    return (
        f"<section><h2>{name}</h2><p class=soft>{nearest(verdict.least_m)}. Again: <code>{again}</code></p>"
        f"{picture(outcome)}<table>{head}{rows}</table></section>"
    )


def _row(number: int, each: ToldVessel, outcome: EncounterOutcome) -> str:
    vessel, truth = outcome.encounter.vessels[number], each.truth
    colour = _COLOURS[number % len(_COLOURS)]
    told = (
        "not told"
        if each.told_s is None
        else f"at {each.told_s:.0f} s as {each.role}, {truth.least_s - each.told_s:.0f} s before"
    )
    meant = "" if each.told_s is None else each.true_role + (" (grey)" if each.grey else "")
    return (
        f"<tr><td style='color:{colour}'><b>{number + 1}</b><td>{vessel.length_m:.0f} m, {vessel.speed_mps:.1f} m/s"
        f"<td>{nearest(truth.least_m)} at {truth.least_s:.0f} s<td>{told}<td>{meant}"
    )


def nearest(metres: float) -> str:
    """A least distance to a hull in words."""
    if math.isinf(metres):
        return "none near"
    return "hit" if metres < 0.0 else f"{metres:.0f} m"


def picture(outcome: EncounterOutcome) -> str:
    """The tracks from above, north up."""
    chart = _Chart(outcome.tracks[0])
    shapes = [shape for number in range(1, len(outcome.tracks)) for shape in chart.vessel(number, outcome)]
    shapes = [*chart.frame(), *shapes, *chart.track(outcome.tracks[0], _OURS, "we", width=3.5)]
    marks = [mark for number in range(len(outcome.told)) for mark in chart.marks(number, outcome)]
    size = f"viewBox='0 0 {_SIDE:.0f} {_SIDE:.0f}' style='max-width:{_SIDE:.0f}px;background:#f6f8fa;border-radius:6px'"
    return f"<svg {size} role='img' aria-label='Tracks from above'>{''.join(shapes)}{''.join(marks)}</svg>"


class _Chart:
    """A square about our leg."""

    def __init__(self, own: Sequence[Point]) -> None:
        self._middle = max(north for north, _ in own) / 2.0
        self._reach = self._middle + 150.0

    def place(self, point: Point) -> Point:
        """Where a point is drawn: x and y."""
        north, east = point
        return (east / self._reach + 1.0) * _SIDE / 2.0, (1.0 - (north - self._middle) / self._reach) * _SIDE / 2.0

    def frame(self) -> list[str]:
        """A scale bar and north."""
        metres = max(each for each in _ROUND_M if each <= self._reach / 2.0)
        length = metres / self._reach * _SIDE / 2.0
        return [
            f"<path d='M14 {_SIDE - 14:.0f}h{length:.0f}' stroke='#57606a' stroke-width='3'/>",
            f"<text x='14' y='{_SIDE - 22:.0f}' font-size='13' fill='#57606a'>{metres:.0f} m</text>",
            f"<text x='{_SIDE - 34:.0f}' y='22' font-size='14' fill='#57606a'>N ↑</text>",
        ]

    def vessel(self, number: int, outcome: EncounterOutcome) -> list[str]:
        colour = _COLOURS[(number - 1) % len(_COLOURS)]
        return self.track(outcome.tracks[number], colour, str(number), width=2.0)

    def track(self, track: Sequence[Point], colour: str, name: str, *, width: float) -> list[str]:
        """A line with its name at the first point in sight, and an arrow at the last."""
        drawn = [self.place(point) for point in track]
        seen = [at for at, (x, y) in enumerate(drawn) if 10.0 < x < _SIDE - 10.0 and 14.0 < y < _SIDE - 10.0]
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in drawn)
        found = [f"<polyline points='{points}' fill='none' stroke='{colour}' stroke-width='{width}'/>"]
        if not seen:
            return found
        (x, y), last = drawn[seen[0]], seen[-1]
        label = f"<text x='{x + 5:.1f}' y='{y - 3:.1f}' font-size='14' font-weight='700' fill='{colour}'>{name}</text>"
        return [*found, *_arrow(drawn[max(0, last - 1)], drawn[last], colour), label]

    def marks(self, number: int, outcome: EncounterOutcome) -> list[str]:
        """Dots where both were nearest, rings where she was told."""
        each, colour = outcome.told[number], _COLOURS[number % len(_COLOURS)]
        found = []
        for at_s, fill in ((each.truth.least_s, colour), (each.told_s, "#fff")):
            if at_s is None:
                continue
            for track in (outcome.tracks[number + 1], outcome.tracks[0]):
                x, y = self.place(track[min(len(track) - 1, round(at_s / TRACK_S))])
                found.append(
                    f"<circle cx='{x:.1f}' cy='{y:.1f}' r='4' fill='{fill}' stroke='{colour}' stroke-width='1.5'/>"
                )
        return found


def _arrow(before: Point, at: Point, colour: str) -> list[str]:
    """A head that points on; none for one at rest."""
    if math.dist(before, at) < 0.2:
        return []
    turn = math.degrees(math.atan2(at[1] - before[1], at[0] - before[0]))
    return [
        f"<path d='M6 0L-6 5L-6 -5z' fill='{colour}' transform='translate({at[0]:.1f} {at[1]:.1f}) rotate({turn:.0f})'/>"
    ]
