"""Which talkers of a line are one receiver: one may use several talkers and change them, two on one line are never mixed.

The same sentence never comes twice with the same UTC from one receiver. So two talkers that both say it are two receivers
(or two solutions of one, such as GPS and Galileo each alone), and a talker that takes turns with another is not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from mavlink_bridge.language.messages import Source

from .epoch import SAME_MOMENT_US, EpochBuilder
from .fields import DAY_US, EpochPart
from .wanted import WantedSentences

_HALF_DAY_US: Final = DAY_US // 2
"""Farther apart, two times of the day have midnight between them."""
_MEMORY_US: Final = 3_000_000
"""A sentence of one moment comes from the slowest device by then."""
_PROOF_US: Final = 1_600_000
"""Two coincidences of one kind within this time are a proof: two receivers coincide at each epoch. One may be a slip, such as a
talker that counts whole seconds and changes its name within one."""
_SIGNS: Final = 4
"""Beside coincidences, so many oddities are as good as a proof."""
_ALTERNATIONS: Final = 8
"""So often in a row taking turns with every single sentence, at uneven intervals: no receiver changes its talker like that."""
_UNEVEN: Final = 0.2
"""One interval longer than the next by this share of both: a receiver keeps its rhythm to a few per cent."""
_RENEW_US: Final = 10_000_000
"""Two receivers prove that they are two with every epoch; what has not been proven for so long is one again."""
_TALKERS_MAX: Final = 12
"""More talkers than the standard has for positions."""
_RECEIVERS_MAX: Final = 4
"""No boat carries more; a line that invents them fills no memory."""


@dataclass(slots=True)
class _Said:
    """The last sentence of one kind from one talker."""

    tod_us: int | None
    at_us: int
    number: int
    """Its place in the sequence of this kind from all talkers."""
    period_us: int | None = None
    """Shortest time between two of them with no other talker's in between."""


@dataclass(slots=True)
class _Pair:
    """What speaks for two talkers being two receivers."""

    since_us: int
    coincided_us: dict[str, int] = field(default_factory=dict)
    """When last, for each kind of sentence."""
    signs: int = 0
    alternations: int = 0
    last_us: int = 0
    two: bool = False


@dataclass(slots=True)
class Receiver:
    """One receiver of a line: its talkers in the order first heard, and what collects its epochs."""

    number: int
    epochs: EpochBuilder
    talkers: list[str] = field(default_factory=list)
    tod_us: int | None = None
    """The UTC time of day that it last named."""


class Receivers:
    """The receivers of one line. ``of`` each position, speed or time sentence in the order received."""

    def __init__(self, wanted: WantedSentences, link: str, make: Callable[[], EpochBuilder]) -> None:
        """``make`` gives each receiver what collects its epochs."""
        self._wanted = wanted
        self._link = link
        self._make = make
        self.all: list[Receiver] = [Receiver(1, make())]
        self._home: dict[str, Receiver] = {}
        self._said: dict[str, dict[str, _Said]] = {}
        self._counts: dict[str, int] = {}
        self._pairs: dict[frozenset[str], _Pair] = {}
        self._placed: set[str] = set()
        self._told_speed_us = -_MEMORY_US

    def of(self, part: EpochPart, now_us: int) -> Receiver | None:
        """The receiver that a sentence comes from; None when it does not count."""
        talker = part.talker
        if part.kind == "GSA":  # satellite lists come under each constellation's own talker
            return self._home.get(talker, self.all[0])
        if self._wanted.receivers is not None and talker not in self._wanted.receivers:
            return None
        home = self._home.get(talker)
        if home is None:
            if len(self._home) >= _TALKERS_MAX:
                return None
            home = self._home[talker] = self.all[0]
            home.talkers.append(talker)
            self._label(home)
        if self._is_hearsay(part, now_us):
            return None
        doubtful = self._weigh(part, home, now_us)
        if len(self._home) > 1:
            home = self._settled(talker)
        if doubtful in home.talkers:
            return None
        if part.tod_us is not None:
            home.tod_us = part.tod_us
        return home

    @property
    def several(self) -> list[Receiver]:
        """Those that have talkers, when there are two and more."""
        found = [receiver for receiver in self.all if receiver.talkers]
        return found if len(found) > 1 else []

    def _is_hearsay(self, part: EpochPart, now_us: int) -> bool:
        """Whether a speed comes from a device without a position of its own, while a receiver tells its own speed (RMC)."""
        if part.lat_rad is not None:
            self._placed.add(part.talker)
        if part.kind == "RMC" and part.sog_mps is not None:
            self._told_speed_us = now_us
        return (
            part.kind == "VTG"
            and part.talker[:1] != "G"
            and part.talker not in self._placed
            and now_us - self._told_speed_us < _MEMORY_US
        )

    # ---- evidence -----------------------------------------------------------------------------------------------

    def _weigh(self, part: EpochPart, home: Receiver, now_us: int) -> str | None:
        """Compare a sentence with the last ones of its kind from other talkers; return one that has just said the same moment."""
        said = self._said.setdefault(part.kind, {})
        number = self._counts[part.kind] = self._counts.get(part.kind, 0) + 1
        own = said.get(part.talker)
        # A speed belongs to the moment that its receiver last named.
        new = _Said(part.tod_us if part.tod_us is not None else home.tod_us, now_us, number)
        doubtful = None
        if len(self._home) > 1:
            for talker, other in said.items():
                if talker != part.talker and now_us - other.at_us <= _MEMORY_US:
                    pair = self._pair(part.talker, talker, now_us)
                    doubtful = talker if self._compare(pair, part.kind, new, own, other) else doubtful
        if own is not None:
            step_us = _step_us(own, new) if own.number == number - 1 else 0
            new.period_us = min(step_us, own.period_us or step_us) if step_us > 0 else own.period_us
        said[part.talker] = new
        return doubtful

    def _compare(self, pair: _Pair, kind: str, new: _Said, own: _Said | None, other: _Said) -> bool:
        """Weigh one sentence against another talker's last; True when both say the same moment."""
        if own is not None and own.number > other.number:
            return False  # the other has not spoken since: nothing new
        later_us = _later_us(new, other)
        taking_turns = own is not None and own.number == new.number - 2
        same = later_us is not None and abs(later_us) <= SAME_MOMENT_US
        sign = later_us is not None and later_us < -SAME_MOMENT_US
        if own is not None and taking_turns:
            sign = sign or _went_on(own, new)
            pair.alternations = pair.alternations + 1 if _uneven(own, other, new) else 0
        if same:
            pair.two |= new.at_us - pair.coincided_us.get(kind, -_PROOF_US) <= _PROOF_US
            pair.coincided_us[kind] = new.at_us
        pair.signs += sign
        pair.two |= pair.signs >= _SIGNS or pair.alternations >= _ALTERNATIONS
        if sign or same or pair.alternations >= _ALTERNATIONS:
            pair.last_us = new.at_us
        return same

    def _pair(self, one: str, other: str, now_us: int) -> _Pair:
        """What is known of two talkers; evidence that is not renewed is forgotten."""
        key = frozenset((one, other))
        pair = self._pairs.get(key)
        if pair is None:
            pair = self._pairs[key] = _Pair(now_us)
        elif now_us - max(pair.last_us, pair.since_us) > _RENEW_US:
            pair.since_us, pair.signs, pair.two = now_us, 0, False
        return pair

    # ---- homes --------------------------------------------------------------------------------------------------

    def _settled(self, talker: str) -> Receiver:
        """Where a talker belongs: with the first receiver that none of its rivals is part of. Of two rivals the later one leaves."""
        home = self._home[talker]
        rival = self._rival_in(home, talker)
        if rival is None:
            if home is self.all[0] or self._rival_in(self.all[0], talker) is not None:
                return home
            return self._move(talker, self.all[0])
        leaving = max((talker, rival), key=home.talkers.index)
        for receiver in self.all:
            if self._rival_in(receiver, leaving) is None:
                self._move(leaving, receiver)
                break
        else:
            if len(self.all) < _RECEIVERS_MAX:
                self.all.append(Receiver(len(self.all) + 1, self._make()))
                self._move(leaving, self.all[-1])
        return self._home[talker]

    def _rival_in(self, receiver: Receiver, talker: str) -> str | None:
        for other in receiver.talkers:
            if other != talker:
                pair = self._pairs.get(frozenset((talker, other)))
                if pair is not None and pair.two:
                    return other
        return None

    def _move(self, talker: str, target: Receiver) -> Receiver:
        before = self._home[talker]
        before.talkers.remove(talker)
        target.talkers.append(talker)
        self._home[talker] = target
        self._label(before)
        self._label(target)
        return target

    def _label(self, receiver: Receiver) -> None:
        """A receiver stays one source whatever talkers it uses; its name tells them."""
        best = min((self._wanted.talker_rank(talker) for talker in receiver.talkers), default=0)
        receiver.epochs.source = Source(
            self._link, f"receiver {receiver.number}", (0, best, receiver.number), "+".join(receiver.talkers)
        )


def _later_us(new: _Said, before: _Said) -> int | None:
    """How much later by its UTC one sentence is than another, less than half a day either way; None when one has no time."""
    if new.tod_us is None or before.tod_us is None:
        return None
    return (new.tod_us - before.tod_us + _HALF_DAY_US) % DAY_US - _HALF_DAY_US


def _step_us(before: _Said, new: _Said) -> int:
    """Time between two sentences: by their UTC, without that by their arrival."""
    later_us = _later_us(new, before)
    return new.at_us - before.at_us if later_us is None else later_us


def _went_on(own: _Said, new: _Said) -> bool:
    """Whether a talker goes on in its own rhythm, as if the other had not spoken in between."""
    return own.period_us is not None and 0 < _step_us(own, new) < 1.5 * own.period_us


def _uneven(own: _Said, other: _Said, new: _Said) -> bool:
    """Whether another talker's sentence lies elsewhere than midway between two of a talker's own."""
    first_us, second_us = _step_us(own, other), _step_us(other, new)
    return abs(first_us - second_us) > _UNEVEN * abs(first_us + second_us)
