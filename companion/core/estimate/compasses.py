"""The compasses: which one counts, which is no longer believed, and what goes from it into the heading."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Final

from mavlink_bridge.language.messages import EulerAngles, GpsFix, Severity
from mavlink_bridge.language.units import wrap_pi

from .doubts.in_turn import InTurn
from .doubts.repeats import RepeatWatch
from .doubts.witness import WINDOW_US, TurnWitness
from .heading import HeadingTrack
from .sources import SOURCES_MAX, UNLABELLED, Choice, Key, Texts, degrees, source_name
from .told import ComesAndGoes

_APART_RAD: Final = math.radians(4.0)
"""Two compasses that are further apart than this are not both right: no noise or lag explains it in the mean of 3 s."""
_IN_TURN: Final = (math.radians(5.0), math.radians(60.0))
"""Two that are further apart than this are told to be two under one name, where the heading changes faster than hulls turn."""
_REPEATS: Final = "repeats one heading"
_AGAINST: Final = "contradicts the turns"
_ANEW: Final = "It is believed again after a turn of 60 deg that it goes along with: by hand"


def _of_chord(chord: float) -> str:
    return degrees(2.0 * math.asin(min(0.5 * chord, 1.0)))


GoesAgainst = Callable[[float], bool]
"""Whether the vessel moves in another direction than a heading points."""


class Compasses:
    """All that tell a heading."""

    def __init__(self, track: HeadingTrack, texts: Texts, distrust: Callable[[int, float], None]) -> None:
        """``distrust`` is told, with the time, that the heading was wrong for the last so many seconds."""
        self.angles: EulerAngles | None = None
        """The newest of the one that counts."""
        self.watch = RepeatWatch()
        self._choice = Choice("Heading", texts, least_s=0.4, most_s=2.2, figure=degrees, wrap=wrap_pi)
        self._track, self._texts, self._distrust = track, texts, distrust
        self._in_turn = InTurn(texts, ("Heading", "compasses"), *_IN_TURN, figure=_of_chord)
        self._told = ComesAndGoes()
        self._newest: dict[Key, tuple[int, float]] = {}
        self._repeated: dict[Key, tuple[float | None, float | None]] = {}
        self._turns: dict[Key, TurnWitness] = {}
        """Of the one that counts, and of each that is given up for what its turns are."""
        self._against: set[Key] = set()

    @property
    def used(self) -> str:
        """Name of the compass that counts; empty before there is one."""
        return self._choice.used

    @property
    def apart(self) -> str:
        """Which two compasses are further apart than a jump, in words; empty where none are."""
        return self._choice.apart(math.radians(self._track.config.heading_jump_deg))

    def note_rate(self, t_us: int, r_radps: float) -> None:
        """Take what a sensor tells of the turn rate."""
        self.watch.note_rate(t_us, r_radps)
        for turns in self._turns.values():
            turns.note_rate(t_us, r_radps)

    def note_fix(self, fix: GpsFix, drift_mps: tuple[float, float], least_mps: float) -> None:
        """Take a fix, the drift, and the least speed through the water at which a course is one."""
        self.watch.note_fix(fix, drift_mps, least_mps)
        for turns in self._turns.values():
            turns.note_fix(fix, drift_mps)

    def update(self, angles: EulerAngles, link: int, goes_against: GoesAgainst) -> bool:
        """Take a heading; True when its compass is the one that counts."""
        track, choice, t_us = self._track, self._choice, angles.t_us
        psi_rad = track.true_heading(angles)
        if psi_rad is None:  # magnetic, and no variation known: shown, not steered by
            shown = choice.silent(t_us)
            if shown:
                self.angles = angles
            return shown
        label = angles.source or UNLABELLED
        self._in_turn.take((link, label.address), source_name(label, link), t_us, cmath.rect(1.0, psi_rad))
        if self._is_repeated(angles, link, psi_rad, goes_against) or self._is_against(angles, link, psi_rad):
            return False
        self._keep(angles, link, psi_rad)
        used = choice.is_chosen(angles.source, link)
        off_rad = None if used or not track.valid(t_us) else wrap_pi(psi_rad - track.at(t_us))
        if choice.leads(angles.source, link, t_us, trusted=used or self._may_take_over(t_us, psi_rad, goes_against)):
            return self._lead(angles, psi_rad, goes_against)
        if track.refusing and choice.undo(angles.source, link):
            track.update_heading(t_us, psi_rad, goes_against)
            return True
        if off_rad is not None:
            choice.compare(angles.source, link, off_rad, _APART_RAD, t_us)
        return False

    def _may_take_over(self, t_us: int, psi_rad: float, goes_against: GoesAgainst) -> bool:
        """Whether a compass may lead beside one that speaks: in the first seconds by its rank, later only if it agrees."""
        if self._track.expects(t_us, psi_rad):
            return True
        return self._choice.settles(t_us) and not goes_against(psi_rad)

    def _keep(self, angles: EulerAngles, link: int, psi_rad: float) -> None:
        key = (link, "" if angles.source is None else angles.source.address)
        if key in self._newest or len(self._newest) < SOURCES_MAX:
            self._newest[key] = (angles.t_us, psi_rad)

    def stand_in(self, now_us: int) -> bool:
        """The heading is lost: let the best of the others that speak lead at once; True when there is one.

        One that is off by more than a jump from what is expected goes through the check for jumps first.
        """
        track, choice = self._track, self._choice
        for key in choice.others(now_us):
            if key not in self._newest:
                continue
            t_us, psi_rad = self._newest[key]
            if not track.expects(now_us, psi_rad):
                continue
            choice.hand_over(key, "jumped" if track.refusing else "silent", now_us)
            track.hand_over(t_us, psi_rad, choice.period_s(key))
            return True
        return False

    def _lead(self, angles: EulerAngles, psi_rad: float, goes_against: GoesAgainst) -> bool:
        """Take the heading of the compass that counts; False when it has just been found to repeat itself."""
        track, choice = self._track, self._choice
        proof = self.watch.hear(choice.chosen, angles)
        if proof and choice.chosen is not None:
            self._repeated[choice.chosen] = (angles.psi_rad, angles.psi_magnetic_rad)
            if self._told.begins(angles.t_us):
                self._texts.append((Severity.ERROR, f"Heading: {choice.used} {_REPEATS} {proof}: not used"))
            choice.bar(_REPEATS)
            self._distrust(angles.t_us, self.watch.same_s)
            return False
        if choice.chosen is not None and self._turns_otherwise(choice.chosen, angles.t_us, psi_rad):
            return False
        self.angles = angles
        if choice.moved and choice.settles(angles.t_us):
            track.move(angles.t_us, psi_rad)
        elif self.watch.hung_s and not track.expects(angles.t_us, psi_rad):
            self._distrust(angles.t_us, self.watch.hung_s)
        track.update_heading(angles.t_us, wrap_pi(psi_rad + self.watch.hidden_rad), goes_against)
        return True

    def _turns_otherwise(self, key: Key, t_us: int, psi_rad: float) -> bool:
        """Whether the compass that counts has just been found to turn otherwise than the vessel: it is given up."""
        if key not in self._turns:
            self._turns = {known: turns for known, turns in self._turns.items() if known in self._against}
            self._turns[key] = TurnWitness()
        if not self._turns[key].hear(t_us, psi_rad):
            return False
        self._against.add(key)
        said = f"Heading: {self._choice.used} {_AGAINST} that turn rate and course tell: not used"
        self._texts.append((Severity.ERROR, said))
        self._texts.append((Severity.INFO, _ANEW))
        self._choice.bar(_AGAINST)
        self._distrust(t_us, WINDOW_US * 1e-6)
        return True

    def _is_against(self, angles: EulerAngles, link: int, psi_rad: float) -> bool:
        """Whether a compass is given up for its turns; it is believed again once it has gone along with one."""
        key = (link, "" if angles.source is None else angles.source.address)
        if key not in self._against:
            return False
        if self._turns[key].hear(angles.t_us, psi_rad) is not False:
            return True
        self._against.discard(key)
        self._choice.lift(key, angles.t_us)
        self._texts.append((Severity.INFO, f"Heading: {self._choice.name(key)} goes along with the turns again"))
        return False

    def _is_repeated(self, angles: EulerAngles, link: int, psi_rad: float, goes_against: GoesAgainst) -> bool:
        """Whether a compass still says what it was given up for; once it says something else it is believed again."""
        if not self._repeated:
            return False
        key = (link, "" if angles.source is None else angles.source.address)
        repeated = self._repeated.get(key)
        if repeated is None:
            return False
        if repeated == (angles.psi_rad, angles.psi_magnetic_rad):
            return True
        if goes_against(psi_rad):
            self._repeated[key] = (angles.psi_rad, angles.psi_magnetic_rad)
            return True
        del self._repeated[key]
        self._choice.lift(key, angles.t_us)
        if self._told.ends():
            self._texts.append((Severity.INFO, f"Heading: {self._choice.name(key)} no longer {_REPEATS}"))
        return False
