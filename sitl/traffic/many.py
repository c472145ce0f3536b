"""Thousands of encounters over this computer's cores: workers that stay, a tally, and a page with pictures of the ten worst."""

from __future__ import annotations

import html
import math
import multiprocessing
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Final

from companion.report.page import document

from .sets import Encounter
from .verdict import Tally, Verdict, verdict_of
from .watch import Outcome, sail

_CHUNK: Final = 8
"""Encounters handed to a worker at once."""
WORST: Final = 10
_SIDE: Final = 420.0
_COLOURS: Final = ("#cf222e", "#9a6700", "#8250df", "#1a7f37", "#bc4c00")


def judge_one(encounter: Encounter) -> Verdict:
    """Sail an encounter and judge it: what a worker does."""
    return verdict_of(sail(encounter))


def judge_all(
    encounters: Sequence[Encounter], workers: int, done: Callable[[int, int], None] = lambda count, total: None
) -> list[Verdict]:
    """Judge encounters, in their order. ``workers`` processes start once and stay to the end; 1: this one does it."""
    found: list[Verdict] = []
    if workers <= 1:
        return _collected(map(judge_one, encounters), len(encounters), found, done)
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        return _collected(pool.map(judge_one, encounters, chunksize=_CHUNK), len(encounters), found, done)


def _collected(
    verdicts: Iterable[Verdict], total: int, found: list[Verdict], done: Callable[[int, int], None]
) -> list[Verdict]:
    for verdict in verdicts:
        found.append(verdict)
        done(len(found), total)
    return found


def tally_of(verdicts: Sequence[Verdict]) -> Tally:
    """The sum of all."""
    total = Tally()
    for verdict in verdicts:
        total.add(verdict.tally)
    return total


def worst_of(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """The ten worst: what was told wrongly first, then the least distances."""
    return sorted(verdicts, key=lambda each: (-_wrong(each.tally), each.least_m))[:WORST]


def _wrong(tally: Tally) -> int:
    return tally.roles_wrong + tally.could_warn - tally.warned


def lines(tally: Tally) -> list[str]:
    """The tally in words."""
    return [
        f"{tally.encounters} encounters, doing nothing: {tally.collisions} collisions, {tally.under_10_m} under 10 m, "
        f"{tally.close} under half of the wanted clearance, {tally.within} under it",
        f"{tally.told} vessels told of; roles right in {tally.roles_share:.2%} ({tally.roles_grey} in grey zones left out)",
        f"told 60 s before the closest point: {tally.warned} of {tally.could_warn} ({tally.warned_share:.2%})",
        f"false alarms: {tally.false_alarms} ({tally.false_share:.2%})",
    ]


def make_page(title: str, verdicts: Sequence[Verdict], encounters: Sequence[Encounter]) -> str:
    """One HTML file: the tally, and the ten worst sailed again for their pictures."""
    by_name = {each.name: each for each in encounters}
    body = [f"<h1>Encounters {html.escape(title)}</h1>"]
    body += [f"<p>{html.escape(line)}</p>" for line in lines(tally_of(verdicts))]
    for verdict in worst_of(verdicts):
        outcome = sail(by_name[verdict.name])
        least = "none near" if math.isinf(verdict.least_m) else f"least distance {verdict.least_m:.1f} m"
        rows = "".join(
            f"<tr><td>{number + 1}<td>{each.truth.least_m:.0f} m at {each.truth.least_s:.0f} s"
            f"<td>{'not told' if each.told_s is None else f'told at {each.told_s:.0f} s as {each.role}'}"
            f"<td>{each.true_role}{' (grey)' if each.grey else ''}"
            for number, each in enumerate(outcome.told)
        )
        head = "<tr><th>Vessel<th>Closest<th>Told<th>By the truth</tr>"
        body.append(
            f"<section><h2>{html.escape(verdict.name)}</h2><p class=soft>{least}</p>{picture(outcome)}<table>{head}{rows}</table></section>"
        )
    return document(f"Encounters {title}", "".join(body))


def picture(outcome: Outcome) -> str:
    """The tracks from above, north up, ours in blue; a dot where each vessel was nearest."""
    own = outcome.tracks[0]
    reach = max(north for north, _ in own) / 2.0 + 150.0
    middle = max(north for north, _ in own) / 2.0

    def place(north: float, east: float) -> str:
        return f"{(east / reach + 1.0) * _SIDE / 2.0:.1f},{(1.0 - (north - middle) / reach) * _SIDE / 2.0:.1f}"

    shapes = []
    for number, track in enumerate(outcome.tracks):
        colour = "#0969da" if not number else _COLOURS[(number - 1) % len(_COLOURS)]
        points = " ".join(place(*point) for point in track)
        shapes.append(f"<polyline points='{points}' fill='none' stroke='{colour}' stroke-width='2'/>")
        if number:
            at = min(len(track) - 1, round(outcome.told[number - 1].truth.least_s / 5.0))
            for point in (track[at], own[min(at, len(own) - 1)]):
                x, y = place(*point).split(",")
                shapes.append(f"<circle cx='{x}' cy='{y}' r='4' fill='{colour}'/>")
    return f"<svg viewBox='0 0 {_SIDE:.0f} {_SIDE:.0f}' style='max-width:{_SIDE:.0f}px'>{''.join(shapes)}</svg>"
