"""The turning points of a run, one line for each moment, for somebody who reads nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from .flight import Event

MAX_MOMENTS: Final = 60
_SEVERITIES: Final = ("EMERGENCY", "ALERT", "CRITICAL", "ERROR", "WARNING", "NOTICE", "INFO", "DEBUG")
_FORETELLS: Final = "Until "
"""How a text begins that says what ends a failsafe."""
_WORDS: Final = {
    "mode": "mode",
    "plan": "plan",
    "plan_state": "plan",
    "action": "failsafe action",
    "guard": "depth guard",
    "fence_breached": "outside the fence",
    "terminated": "terminated",
}


@dataclass(frozen=True, slots=True)
class Moment:
    """What came at one time, and how bad the worst of it is (a MAV_SEVERITY name)."""

    t_s: float
    text: str
    severity: str


def tell(events: Iterable[Event]) -> list[Moment]:
    """The moments at which a mode, a plan, arming, the guard or a failsafe changed, or the vessel said something of weight."""
    ordered = sorted(events, key=lambda event: event.t_s)
    moments = []
    for _, group in groupby(ordered, key=lambda event: int(event.t_s)):
        together = list(group)
        said = list(dict.fromkeys(_lines(together)))
        if said:
            worst = min((event.severity for event in together), key=_weight)
            moments.append(Moment(together[0].t_s, "; ".join(said), worst))
    return moments


def weightiest(moments: Sequence[Moment], most: int = MAX_MOMENTS) -> list[Moment]:
    """The ``most`` weightiest moments, in their order."""
    kept = sorted(moments, key=lambda moment: _weight(moment.severity))[:most]
    return sorted(kept, key=lambda moment: moment.t_s)


def _weight(severity: str) -> int:
    return _SEVERITIES.index(severity) if severity in _SEVERITIES else len(_SEVERITIES)


def _lines(events: Sequence[Event]) -> Iterator[str]:
    """The vessel's own words first, then what changed."""
    for event in events:
        weighs = _weight(event.severity) <= _SEVERITIES.index("NOTICE") or event.text.startswith(_FORETELLS)
        if event.kind == "text" and weighs:
            yield event.text
    for event in events:
        if "→" not in event.text:
            continue
        if event.kind == "armed":
            yield "armed" if event.text.endswith(("yes", "→ armed")) else "disarmed"
        elif event.kind in _WORDS:
            changed = event.text.lower().replace("_", " ")
            word = _WORDS[event.kind]
            yield changed if changed.startswith(word) else f"{word} {changed}"
