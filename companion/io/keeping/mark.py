"""Whose a store is: the kind of its world (a real boat's or a simulation's) and the vessel's random id, and what follows from it.

A store of the other world is not used. One without a mark is of the first release, where a rehearsal could write into the
boat's own memory: its parameters count, its plans and soundings wait in sections of their own until somebody has seen
and adopted them. Pure: rows in, changes out.
"""

from __future__ import annotations

import json
import secrets
from collections import Counter
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import Final

from .content import FENCE_LOST, StoreContent, StoredRow
from .file import MIGRATIONS

Rows = Mapping[tuple[str, str], str]
UNTRUSTED: Final = {"plan": "old-plan", "depth": "old-depth"}
"""Sections of an unmarked store that could move or blind a boat, and where they wait."""
ASIDE: Final = "store/aside"
"""Record: another world's store lay here and was set aside (its name); no departure until the operator says what counts."""


class WorldKind(StrEnum):
    """What kind of world a process sails in."""

    REAL = "real"
    SIMULATED = "simulated"


class ForeignError(Exception):
    """The store of another kind of world; the text says of which."""


def new_vessel_id() -> str:
    """A vessel's id: 128 random bits, 32 hexadecimal digits."""
    return secrets.token_hex(16)


def marks(world: WorldKind, vessel: str) -> list[StoredRow]:
    """The rows that say whose a store is, and in what form."""
    found = {"world": world.value, "vessel": vessel, "schema": str(len(MIGRATIONS))}
    return [StoredRow("meta", key, json.dumps(text)) for key, text in found.items()]


def settle(
    rows: Rows, world: WorldKind, new_id: Callable[[], str] = new_vessel_id
) -> tuple[list[StoredRow], list[str]]:
    """Return the changes that make rows this world's store, and what to tell of them.

    Raises ForeignError when they are another world's, or unmarked while this is a simulation: a boat's, for all one knows.
    """
    found = _meta(rows, "world")
    if found == world:
        wanted = marks(world, _meta(rows, "vessel") or new_id())
        return [entry for entry in wanted if rows.get((entry.section, entry.key)) != entry.body], []
    if found is not None:
        raise ForeignError(f"written by a {found} vessel")
    if world is WorldKind.SIMULATED and rows:
        raise ForeignError("without the mark of a simulation")
    waiting = [(section, key, body) for (section, key), body in rows.items() if section in UNTRUSTED]
    changes = [StoredRow(UNTRUSTED[section], key, body) for section, key, body in waiting]
    changes += [StoredRow(section, key, None) for section, key, _ in waiting]
    counted = Counter(section for section, _, body in waiting if body != "[]")
    texts = []
    if counted:
        what = " and ".join(_count(counted[section], name) for section, name in _NAMES.items() if counted[section])
        texts = [f"Store without a mark (first release): {what} unused until 'companion store adopt'"]
    return changes + marks(world, _meta(rows, "vessel") or new_id()), texts


_NAMES: Final = {"plan": "plan", "depth": "tile of soundings"}


def _count(number: int, name: str) -> str:
    head, _, tail = name.partition(" ")
    return f"{number} {head}{'s' * (number > 1)}{' ' * bool(tail)}{tail}"


def _meta(rows: Rows, key: str) -> str | None:
    try:
        found = json.loads(rows.get(("meta", key), "null"))
    except ValueError:
        return None
    return found if isinstance(found, str) else None


def departure_refusal(content: StoreContent) -> str:
    """Why a boat with this store must not depart, and the mend; empty when it may."""
    aside = content.records.get(ASIDE)
    if aside is None:
        return ""
    return f"store: a simulation's file was set aside ({aside.data}): put your own back, or 'companion store adopt'"


def fence_refusal(content: StoreContent) -> str:
    """The same of a fence that the store has lost."""
    lost = content.records.get(FENCE_LOST)
    return "" if lost is None else f"store: the fence {lost.data}: load it again, or clear it"
