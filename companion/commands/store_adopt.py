"""``companion store adopt``: show what waits in a store because nobody knows which world wrote it, and take it over or drop it."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from mavlink_bridge.language.requests import PlanItem
from mavlink_bridge.language.units import e7_to_deg

from ..io.keeping import StoreContent
from ..io.keeping.content import StoredRow, rows_of
from ..io.keeping.depth_store import soundings_of
from ..io.keeping.look import look
from ..io.keeping.mark import ASIDE, UNTRUSTED, ForeignError
from ..settings import ConfigError
from .store import read_store, write_store


def add_action(actions: Any) -> None:
    """Add the action to ``companion store``."""
    parser = actions.add_parser(
        "adopt", help="see and take over what an older or another store left", description=__doc__
    )
    parser.add_argument("store", type=Path, help="the boat's store; the vessel must not be running")
    answer = parser.add_mutually_exclusive_group()
    answer.add_argument("--yes", action="store_true", help="take it over without asking")
    answer.add_argument("--forget", action="store_true", help="drop what waits; parameters stay")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Exit status 0 done or nothing to do, 1 left as it was, 2 no store of a boat."""
    path: Path = arguments.store
    read_store(path)
    try:
        content, _ = look(path).as_used()
    except ForeignError as error:
        mend = "a boat takes its parameters and plans by 'companion store export' and 'import'"
        raise ConfigError(str(path), [f"{error}: {mend}"]) from None
    aside = content.records.get(ASIDE)
    if not content.old_plans and not content.old_depth and aside is None:
        print(f"{path}: nothing waits to be adopted")
        return 0
    for line in waiting(content):
        print(line)
    if not arguments.yes and not arguments.forget and not _asked():
        print("left as it is")
        return 1
    entries = [StoredRow("record", ASIDE, None)] if aside else []
    entries += [] if arguments.forget else list(_taken(content))
    entries += [StoredRow(section, "", None) for section in UNTRUSTED.values()]
    if not write_store(path, entries):
        return 1
    print(f"{path}: {'dropped' if arguments.forget else 'taken over'}")
    return 0


def waiting(content: StoreContent) -> Iterator[str]:
    """What a person must see before it may count, one line each."""
    aside = content.records.get(ASIDE)
    if aside is not None:
        yield f"set aside  {aside.data}, a simulation's: this store began without what the boat's own held"
    for kind, items in content.old_plans.items():
        if items:
            there = "; newer ones are loaded and stay" if kind in content.plans else ""
            yield f"{kind.name.lower():10} {len(items)} items{_box(_places(items))}{there}"
    if content.old_depth:
        found = list(soundings_of(StoreContent(depth=content.old_depth)))
        count = sum(each.soundings for each in found)
        yield f"depth      {count} soundings in {len(found)} places{_box((each.lat_deg, each.lon_deg) for each in found)}"
        if found:
            yield f"           {min(each.least_m for each in found):.2f} to {max(each.depth_m for each in found):.2f} m deep"


def _places(items: Iterable[PlanItem]) -> Iterator[tuple[float, float]]:
    for item in items:
        if item.x or item.y:
            yield e7_to_deg(item.x), e7_to_deg(item.y)


def _box(places: Iterable[tuple[float, float]]) -> str:
    found = [(lat, lon) for lat, lon in places if math.isfinite(lat) and math.isfinite(lon)]
    if not found:
        return ""
    lats, lons = zip(*found, strict=True)
    return f", {min(lats):.5f} to {max(lats):.5f} N, {min(lons):.5f} to {max(lons):.5f} E"


def _taken(content: StoreContent) -> Iterator[StoredRow]:
    """The rows that wait, where nothing newer is."""
    rows = rows_of(content)
    trusted = {old: section for section, old in UNTRUSTED.items()}
    for (section, key), body in rows.items():
        if section in trusted and (trusted[section], key) not in rows:
            yield StoredRow(trusted[section], key, body)


def _asked() -> bool:
    if not sys.stdin.isatty():
        print("not a terminal: --yes takes it over, --forget drops it")
        return False
    return input("Is all of this the boat's own, of real water? Take it over? [y/N] ").strip().lower() in ("y", "yes")
