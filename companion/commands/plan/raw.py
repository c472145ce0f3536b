"""Plan items as MAVSDK has them, and back; and the bar that shows how far a plan has gone over a slow link."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.language.units import e7_to_rad


def show_bar(share: float | None) -> None:
    """A progress bar on a terminal; None ends it."""
    if not sys.stderr.isatty():
        return
    if share is None:
        print("\r" + " " * 50 + "\r", end="", file=sys.stderr)
        return
    done = round(40 * share)
    print(f"\r[{'#' * done}{'.' * (40 - done)}] {share:4.0%}", end="", file=sys.stderr, flush=True)


def raw_items(items: Sequence[PlanItem], kind: PlanKind) -> list[Any]:
    """A plan's items, numbered, as they are uploaded."""
    from mavsdk.plugins.mission_raw import MissionItem

    return [
        MissionItem(
            *(seq, item.frame, item.command, int(seq == 0 and kind is PlanKind.MISSION), item.autocontinue),
            *(item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z, kind.value),
        )
        for seq, item in enumerate(items)
    ]


def plan_item(raw: Any) -> PlanItem:
    """An item that was downloaded."""
    return PlanItem(
        *(raw.command, raw.frame, raw.param1, raw.param2, raw.param3, raw.param4, raw.x, raw.y, raw.z, raw.autocontinue)
    )


def place_rad(item: PlanItem) -> tuple[float, float]:
    """Where an item lies, latitude and longitude."""
    return e7_to_rad(item.x), e7_to_rad(item.y)
