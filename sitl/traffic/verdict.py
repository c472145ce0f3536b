"""What an encounter's truth says of what the boat told: roles, warnings in time, false alarms; and the sums over many."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final

from .score import SURELY_CLOSE
from .watch import EncounterOutcome, ToldVessel

IN_TIME_S: Final = 60.0
"""A warning comes so long before the closest point."""
CLOSE_IN_TIME_S: Final = 10.0
"""Close is told so long before her hull is surely close; it is due 20 s before half of the wanted clearance."""
_SLACK_S: Final = 5.0
"""A report that came less than this before could not say so in time."""
_FALSE_FACTOR: Final = 2.0
"""Told, though her true course never led within twice the wanted clearance: between once and twice lies what a course that is two
degrees off cannot tell three minutes ahead."""
_AROUND_S: Final = 60.0


@dataclass(slots=True)
class EncounterTally:
    """Counts over encounters, and over their vessels."""

    encounters: int = 0
    collisions: int = 0
    """Encounters in which we do nothing and are hit: closer than 2 m to a hull."""
    under_10_m: int = 0
    close: int = 0
    """Closer than half of the wanted clearance."""
    within: int = 0
    """Closer than the wanted clearance."""
    told: int = 0
    roles_right: int = 0
    roles_wrong: int = 0
    roles_grey: int = 0
    false_alarms: int = 0
    could_warn: int = 0
    """Vessels that came within the wanted clearance, and of which a report in time said so."""
    warned: int = 0
    """Of these: told 60 s before the closest point."""
    could_close: int = 0
    """Vessels whose hull came surely close, and of which a report in time said so."""
    closed: int = 0
    """Of these: told as close 10 s before."""

    def add(self, other: EncounterTally) -> None:
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))

    @property
    def roles_share(self) -> float:
        return self.roles_right / max(1, self.roles_right + self.roles_wrong)

    @property
    def warned_share(self) -> float:
        return self.warned / max(1, self.could_warn)

    @property
    def closed_share(self) -> float:
        return self.closed / max(1, self.could_close)

    @property
    def false_share(self) -> float:
        return self.false_alarms / max(1, self.told)


@dataclass(slots=True)
class EncounterVerdict:
    """One encounter's."""

    name: str
    least_m: float
    tally: EncounterTally


def verdict_of(outcome: EncounterOutcome) -> EncounterVerdict:
    """Judge what was told in an encounter."""
    truths = [each.truth for each in outcome.told]
    tally = EncounterTally(
        encounters=1,
        collisions=int(outcome.collision),
        under_10_m=int(outcome.least_m < 10.0),
        close=int(any(truth.close for truth in truths)),
        within=int(any(truth.within for truth in truths)),
    )
    for each in outcome.told:
        if each.told_s is not None:
            _judge_told(each, each.told_s, tally)
        truth = each.truth
        if truth.within and _said_before(each, truth.least_s - IN_TIME_S, truth.wanted_m):
            tally.could_warn += 1
            tally.warned += int(each.told_s is not None and each.told_s <= each.truth.least_s - IN_TIME_S)
        near_s = truth.near_s
        if near_s is not None and _said_before(each, near_s - CLOSE_IN_TIME_S, SURELY_CLOSE * truth.wanted_m):
            tally.could_close += 1
            tally.closed += int(each.close_s is not None and each.close_s <= near_s - CLOSE_IN_TIME_S)
    return EncounterVerdict(outcome.encounter.name, outcome.least_m, tally)


def _judge_told(each: ToldVessel, told_s: float, tally: EncounterTally) -> None:
    tally.told += 1
    if each.grey:
        tally.roles_grey += 1
    elif each.role == each.true_role:
        tally.roles_right += 1
    else:
        tally.roles_wrong += 1
    truth = each.truth
    far_m = _FALSE_FACTOR * truth.wanted_m
    near = truth.least_predicted_m(told_s - _AROUND_S, told_s + _AROUND_S) < far_m or truth.least_m < far_m
    tally.false_alarms += int(not near)


def _said_before(each: ToldVessel, due_s: float, metres: float) -> bool:
    """Whether a report in time for ``due_s`` said that she would come so near."""
    return any(
        heard_s <= due_s - _SLACK_S and each.truth.least_predicted_m(heard_s - 2.0, heard_s + 2.0) < metres
        for heard_s in each.heard_s
    )
