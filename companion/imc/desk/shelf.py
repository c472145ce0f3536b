"""The console's plans, kept by name: their bytes as they came, who changed them and when. Bounded; survives a restart as one text.

The sum that consoles compare is the MD5 of the plan's fields, little-endian, without header and CRC; the collection's is the MD5 of
the plans' sums one after the other in the order of their names (imc-wire §0, §4).
"""

from __future__ import annotations

import base64
import binascii
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge import imc

MAX_BYTES: Final = 2_000_000
"""Of all plans together: a hundred of the largest that were met."""


@dataclass(frozen=True, slots=True)
class ShelvedPlan:
    """One plan as it came."""

    data: bytes
    """Its fields, little-endian."""
    changed_utc_s: float
    changed_by: int
    """IMC id."""
    changed_name: str

    @property
    def md5(self) -> bytes:
        return hashlib.md5(self.data, usedforsecurity=False).digest()

    def spec(self) -> imc.PlanSpecification:
        found = imc.parse_fields(imc.PlanSpecification, self.data)
        assert isinstance(found, imc.PlanSpecification)
        return found


class Shelf:
    """The collection. ``max_plans``: more are refused."""

    def __init__(self, max_plans: int, saved: object = None) -> None:
        self._max_plans = max_plans
        self._plans: dict[str, ShelvedPlan] = {}
        self.last: ShelvedPlan | None = None
        """The newest change."""
        for name, row in saved.items() if isinstance(saved, dict) else ():
            kept = _read(row)
            if kept is not None and len(self._plans) < max_plans:
                self._plans[str(name)] = kept

    def get(self, name: str) -> ShelvedPlan | None:
        return self._plans.get(name)

    def __contains__(self, name: str) -> bool:
        return name in self._plans

    def put(self, name: str, kept: ShelvedPlan) -> str:
        """Keep a plan; returns why not, or ""."""
        others = sum(len(each.data) for other, each in self._plans.items() if other != name)
        if others + len(kept.data) > MAX_BYTES:
            return f"no room: {MAX_BYTES} bytes of plans are the most; delete some"
        if name not in self._plans and len(self._plans) >= self._max_plans:
            return f"no room: {self._max_plans} plans are the most; delete some"
        self._plans[name] = self.last = kept
        return ""

    def remove(self, name: str) -> bool:
        return self._plans.pop(name, None) is not None

    def clear(self) -> None:
        self._plans.clear()

    def info(self, name: str) -> imc.PlanDBInformation:
        """Raises KeyError for a plan that is not there."""
        kept = self._plans[name]
        return imc.PlanDBInformation(
            plan_id=name,
            plan_size=len(kept.data),
            change_time_s=kept.changed_utc_s,
            change_sid=kept.changed_by,
            change_sname=kept.changed_name,
            md5=kept.md5,
        )

    def state(self) -> imc.PlanDBState:
        """The whole collection, plans in the order of their names."""
        names = sorted(self._plans)
        newest = max(self._plans.values(), key=lambda kept: kept.changed_utc_s, default=None)
        sums = b"".join(self._plans[name].md5 for name in names)
        return imc.PlanDBState(
            plan_count=len(names),
            plan_size=sum(len(kept.data) for kept in self._plans.values()),
            change_time_s=newest.changed_utc_s if newest else 0.0,
            change_sid=newest.changed_by if newest else 0xFFFF,
            change_sname=newest.changed_name if newest else "",
            md5=hashlib.md5(sums, usedforsecurity=False).digest(),
            plans_info=tuple(self.info(name) for name in names),
        )

    def export(self) -> Mapping[str, Any]:
        return {
            name: [
                base64.b64encode(kept.data).decode("ascii"),
                kept.changed_utc_s,
                kept.changed_by,
                kept.changed_name,
            ]
            for name, kept in self._plans.items()
        }


def _read(row: object) -> ShelvedPlan | None:
    """A kept plan out of the store; None for what is none, or cannot be read any more."""
    try:
        saved: list[Any] = list(row)  # type: ignore[call-overload]
        data = base64.b64decode(saved[0], validate=True)
        kept = ShelvedPlan(data, changed_utc_s=float(saved[1]), changed_by=int(saved[2]), changed_name=str(saved[3]))
        kept.spec()
    except (TypeError, ValueError, IndexError, binascii.Error, imc.MalformedError):
        return None
    return kept
