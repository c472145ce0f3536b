"""Downloads: what was counted for a ground station is what it gets, even when another one changes the plan meanwhile."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Final

from ...language.requests import PlanItem, PlanKind
from ..persona.port import PlanStore
from ..wire.codec import dialect
from .store import Sender
from .wire import item_to_message, with_home

_MAX_DOWNLOADS: Final = 16
_FORGET_US: Final = 60_000_000


@dataclass(slots=True)
class _Download:
    items: tuple[PlanItem, ...]
    used_us: int


class Downloads:
    """Answers lists and requests for items. Bounded: the oldest download is forgotten first."""

    def __init__(self, store: PlanStore, *, home_item: bool) -> None:
        self.store = store
        self.home_item = home_item
        self._open: OrderedDict[tuple[Sender, PlanKind], _Download] = OrderedDict()

    def shown(self, kind: PlanKind) -> tuple[PlanItem, ...]:
        """The plan in force as this link counts it."""
        items = self.store.items(kind)
        return with_home(items, self.store.home) if self.home_item and kind is PlanKind.MISSION else items

    def begin(self, sender: Sender, kind: PlanKind, now_us: int) -> Any:
        """MISSION_COUNT for a station that asks for the list."""
        items = self.shown(kind)
        self._open.pop((sender, kind), None)
        if items:
            self._open[sender, kind] = _Download(items, now_us)
        if len(self._open) > _MAX_DOWNLOADS:
            self._open.popitem(last=False)
        return dialect.MAVLink_mission_count_message(
            *sender, len(items), kind.value, opaque_id=self.store.plan_id(kind)
        )

    def item(self, sender: Sender, kind: PlanKind, seq: int, now_us: int) -> Any | None:
        """MISSION_ITEM_INT, or None when there is no such item. A station that did not ask for the list gets the plan in force."""
        download = self._open.get((sender, kind))
        if download is not None and now_us - download.used_us > _FORGET_US:
            del self._open[sender, kind]
            download = None
        items = download.items if download else self.shown(kind)
        if download:
            download.used_us = now_us
        return item_to_message(items[seq], seq, *sender, kind) if seq < len(items) else None

    def end(self, sender: Sender, kind: PlanKind) -> None:
        """The station has everything, or gives up."""
        self._open.pop((sender, kind), None)
