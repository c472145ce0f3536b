"""Which talkers and sentences of an NMEA line count, and in which order they are preferred: ``sentences`` and ``talkers``."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from .sentences import KINDS, kind_of

_NO_POSITION: Final = frozenset({"AG", "AP", "HC", "HE", "HN", "SD", "TI", "VD", "VM", "VW", "WI", "YX"})
"""Talkers of devices that have no position (IEC 61162-1 table 4): naming one says nothing about receivers."""
_REPEATERS: Final = frozenset({"AG", "AP", "EC", "II", "IN"})
"""Autopilots, chart plotters and integrated systems mostly say again, later, what another device has measured."""
_MAGNETIC: Final = frozenset({"HDG", "HDM", "PTNTHTM"})
_KIND_RANK: Final = {
    "THS": 1,
    "PASHR": 2,
    "PSAT": 2,
    "PSXN": 2,
    "PTNL": 2,
    "PSTI": 2,
    "HDM": 1,
    "PTNTHTM": 2,
    "XDR": 3,
    "DPT": 1,
    "DBK": 2,
    "DBS": 3,
}
"""Of the sentences with one quantity the plainest leads: HDT before its kin, HDG (which may know its deviation) before HDM,
DBT and DPT before what is counted from elsewhere than the transducer. What is not named here comes first."""
_UNNAMED: Final = 99
"""Behind every talker that the configuration can name."""
_AIS: Final = frozenset(("VDM", "VDO"))
"""Sentences of AIS, read by a room of their own."""


def _split(entries: Iterable[str]) -> tuple[list[str], frozenset[str]]:
    """Entries as they stand, and those with a minus in front, which are forbidden."""
    names = [entry.strip().upper() for entry in entries if entry.strip()]
    return [name for name in names if name[0] != "-"], frozenset(name[1:].strip() for name in names if name[0] == "-")


class WantedSentences:
    """What a line's ``sentences`` (names or formatters) and ``talkers`` allow and prefer."""

    def __init__(self, sentences: str, talkers: Iterable[str]) -> None:
        named, self._forbidden = _split(sentences.split(","))
        self._talkers, self._forbidden_talkers = _split(talkers)
        self.order = [kind_of(name)[1] for name in named]
        """The formatters named, in the order in which they are sent."""
        self._named = frozenset(named)
        self._kinds = frozenset(self.order) or KINDS
        receivers = frozenset(self._talkers) - _NO_POSITION
        self.receivers: frozenset[str] | None = receivers if receivers else None
        """The only talkers whose position, speed and time count; None = any."""

    def allows(self, address: str) -> bool:
        """Whether sentences of this address are read at all."""
        talker, kind = kind_of(address)
        if address in self._forbidden or kind in self._forbidden or talker in self._forbidden_talkers:
            return False
        return kind in self._kinds

    def forbids(self, address: str) -> bool:
        """Whether an address, its formatter or its talker stands behind a minus."""
        return bool(self._forbidden & {address, address[2:]}) or address[:2] in self._forbidden_talkers

    def talker_rank(self, talker: str) -> int:
        """Preference of a talker: first those named, in their order, then sensors, then repeaters; lower is better."""
        if talker in self._talkers:
            return self._talkers.index(talker)
        return _UNNAMED + (2 if talker in _REPEATERS else 0 if talker[:1] in ("G", "") else 1)

    def rank(self, address: str) -> tuple[int, ...]:
        """Preference of an address: lower is better. A magnetic heading comes last, also across links, unless its talker is named."""
        talker, kind = kind_of(address)
        late = kind in _MAGNETIC and talker not in self._talkers
        named_talker = self._talkers.index(talker) if talker in self._talkers else _UNNAMED
        unnamed = address not in self._named
        return (int(late), named_talker, int(unnamed), _KIND_RANK.get(kind, 0), self.talker_rank(talker))


def unknown_names(text: str) -> list[str]:
    """Return the names in a ``sentences`` setting that are no sentence understood here."""
    named, forbidden = _split(text.split(","))
    known = KINDS | _AIS
    return [name for name in (*named, *sorted(forbidden)) if kind_of(name)[1] not in known]
