"""What the shore keeps of the vessel over a restart: plans, parameters, home, and the last state with its UTC, as one line of text.

A restored state is as old as the calendar says. Where that makes no sense (no calendar then or now, or a clock that went
back) the state is kept to be looked at, but counts as too old for heartbeats.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, Final

from ...language.requests import PlanItem, PlanKind
from ..codec.bits import BitsError
from ..codec.plan import PlanCodecError, decode_plan, encode_plan
from ..codec.state import decode_key, encode_key
from ..codec.state_fields import RadioState

_LONG_AGO_US: Final = 366 * 86_400_000_000


@dataclass(frozen=True, slots=True)
class ShorePicture:
    """The vessel as last known on shore."""

    plans: dict[PlanKind, tuple[PlanItem, ...]] = field(default_factory=dict)
    unsure: dict[PlanKind, tuple[PlanItem, ...]] = field(default_factory=dict)
    """Plans that were sent and neither confirmed nor refused."""
    params: dict[str, float] = field(default_factory=dict)
    home_e7: tuple[int, int] | None = None
    state: RadioState | None = None
    state_utc_us: int = 0
    """When the state was heard; 0 = not known."""


def write(picture: ShorePicture) -> str:
    """Make a text of it."""
    fields = {
        "plans": _plans_out(picture.plans),
        "unsure": _plans_out(picture.unsure),
        "params": picture.params,
        "home": picture.home_e7,
        "state": None if picture.state is None else encode_key(picture.state).hex(),
        "utc": picture.state_utc_us,
    }
    return json.dumps(fields, separators=(",", ":"))


def read(text: str) -> ShorePicture | None:
    """Take a text back; None for an empty or damaged one: the vessel tells it all again."""
    if not text:
        return None
    try:
        fields: dict[str, Any] = json.loads(text)
        home = fields["home"]
        return ShorePicture(
            plans=_plans_in(fields["plans"]),
            unsure=_plans_in(fields["unsure"]),
            params={str(name): float(value) for name, value in fields["params"].items()},
            home_e7=None if home is None else (int(home[0]), int(home[1])),
            state=_state_in(fields["state"]),
            state_utc_us=int(fields["utc"]),
        )
    except (ValueError, TypeError, KeyError, AttributeError, IndexError, BitsError, PlanCodecError):
        return None


def heard_us(picture: ShorePicture, utc_us: int, now_us: int) -> int:
    """When the restored state was heard, on the present clock, which may be before its start. ``utc_us``: the calendar now, 0 = unknown."""
    age_us = utc_us - picture.state_utc_us
    if not utc_us or not picture.state_utc_us or not 0 <= age_us <= _LONG_AGO_US:
        age_us = _LONG_AGO_US
    return now_us - age_us


def _state_in(text: str | None) -> RadioState | None:
    """The last state; None for one of another version, which the vessel's next word replaces."""
    try:
        return None if text is None else decode_key(bytes.fromhex(text))
    except BitsError:
        return None


def _plans_out(plans: dict[PlanKind, tuple[PlanItem, ...]]) -> list[str]:
    return [encode_plan(kind, items, None).hex() for kind, items in plans.items() if items]


def _plans_in(texts: list[str]) -> dict[PlanKind, tuple[PlanItem, ...]]:
    return dict(decode_plan(bytes.fromhex(text), None) for text in texts)
