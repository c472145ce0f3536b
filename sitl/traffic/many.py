"""Thousands of encounters over this computer's cores: workers that stay, and a tally."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Final

from .sets import Encounter
from .verdict import EncounterTally, EncounterVerdict, verdict_of
from .watch import sail

_CHUNK: Final = 8
"""Encounters handed to a worker at once."""
WORST: Final = 10


def judge_one(encounter: Encounter) -> EncounterVerdict:
    """Sail an encounter and judge it: what a worker does."""
    return verdict_of(sail(encounter))


def judge_all(
    encounters: Sequence[Encounter], workers: int, done: Callable[[int, int], None] = lambda count, total: None
) -> list[EncounterVerdict]:
    """Judge encounters, in their order. ``workers`` processes start once and stay to the end; 1: this one does it."""
    found: list[EncounterVerdict] = []
    if workers <= 1:
        return _collected(map(judge_one, encounters), len(encounters), found, done)
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        return _collected(pool.map(judge_one, encounters, chunksize=_CHUNK), len(encounters), found, done)


def _collected(
    verdicts: Iterable[EncounterVerdict], total: int, found: list[EncounterVerdict], done: Callable[[int, int], None]
) -> list[EncounterVerdict]:
    for verdict in verdicts:
        found.append(verdict)
        done(len(found), total)
    return found


def tally_of(verdicts: Sequence[EncounterVerdict]) -> EncounterTally:
    """The sum of all."""
    total = EncounterTally()
    for verdict in verdicts:
        total.add(verdict.tally)
    return total


def worst_of(verdicts: Sequence[EncounterVerdict]) -> list[EncounterVerdict]:
    """The ten worst: what was told wrongly first, then the least distances."""
    return sorted(verdicts, key=lambda each: (-_wrong(each.tally), each.least_m))[:WORST]


def _wrong(tally: EncounterTally) -> int:
    return tally.roles_wrong + tally.could_warn - tally.warned + tally.could_close - tally.closed


def failures(verdicts: Sequence[EncounterVerdict]) -> dict[str, list[str]]:
    """Names of the encounters in which something went wrong, by what; each is sailed again by its name."""
    return {
        "hit": [each.name for each in verdicts if each.tally.collisions],
        "role": [each.name for each in verdicts if each.tally.roles_wrong],
        "late": [each.name for each in verdicts if each.tally.warned < each.tally.could_warn],
        "close late": [each.name for each in verdicts if each.tally.closed < each.tally.could_close],
        "false alarm": [each.name for each in verdicts if each.tally.false_alarms],
    }


def lines(tally: EncounterTally) -> list[str]:
    """The tally in words."""
    return [
        f"{tally.encounters} encounters, doing nothing: {tally.collisions} collisions, {tally.under_10_m} under 10 m, "
        f"{tally.close} under half of the wanted clearance, {tally.within} under it",
        f"{tally.told} vessels told of; roles right in {tally.roles_share:.2%} ({tally.roles_grey} in grey zones left out)",
        f"told 60 s before the closest point: {tally.warned} of {tally.could_warn} ({tally.warned_share:.2%})",
        f"told as close 10 s before her hull is within a quarter of the wanted clearance: {tally.closed} of {tally.could_close} "
        f"({tally.closed_share:.2%})",
        f"false alarms: {tally.false_alarms} ({tally.false_share:.2%})",
    ]
