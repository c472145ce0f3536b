"""What the vessel remembers across a restart, as plain values, and the small changes that are made to it."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from mavlink_bridge.language.requests import PlanItem, PlanKind

SECTIONS: Final = (
    "plan",
    "param",
    "ledger",
    "stamp",
    "counter",
    "value",
    "depth",
    "record",
    "old-plan",
    "old-depth",
    "meta",
)
"""Sections of the store, in the order of the fields below."""
FENCE_LOST: Final = "store/fence-lost"
"""Record: what damage did to the fence; no departure until one is loaded again, or none on purpose."""


class Record(NamedTuple):
    """A named blob of somebody's own: ``data`` is what JSON can hold, ``version`` its owner's."""

    version: int
    data: Any


@dataclass(frozen=True, slots=True)
class StoreContent:
    """Everything in the store at one moment."""

    plans: Mapping[PlanKind, tuple[PlanItem, ...]] = field(default_factory=dict)
    params: Mapping[str, float] = field(default_factory=dict)
    """Parameter overrides by name."""
    ledger: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """Airtime spent, by radio: (UTC in microseconds, airtime in microseconds), oldest first."""
    stamps: Mapping[str, int] = field(default_factory=dict)
    """Newest signing time stamp by stream."""
    counters: Mapping[str, int] = field(default_factory=dict)
    values: Mapping[str, str] = field(default_factory=dict)
    depth: Mapping[str, str] = field(default_factory=dict)
    """Tiles of the depth memory, packed, by ``cell size in mm/row/column``."""
    records: Mapping[str, Record] = field(default_factory=dict)
    """Everything that needs no section of its own, by ``purpose`` or ``purpose/subject``."""
    old_plans: Mapping[PlanKind, tuple[PlanItem, ...]] = field(default_factory=dict)
    """Plans of an unmarked store: unused until an operator has seen and adopted them."""
    old_depth: Mapping[str, str] = field(default_factory=dict)
    """Tiles of an unmarked store, likewise."""
    meta: Mapping[str, str] = field(default_factory=dict, compare=False)
    """Whose it is, not what is in it: ``world`` and ``vessel``; see ``store_mark``."""

    @property
    def world(self) -> str | None:
        """Kind of the world that wrote it, "real" or "simulated"; None = not known."""
        return self.meta.get("world")

    @property
    def vessel(self) -> str | None:
        """The vessel's random id, 32 hexadecimal digits, made with the store; None = not known."""
        return self.meta.get("vessel")


@dataclass(frozen=True, slots=True)
class SavePlan:
    kind: PlanKind
    items: tuple[PlanItem, ...]
    """Empty: the plan is cleared."""


@dataclass(frozen=True, slots=True)
class SaveParam:
    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ForgetParams:
    """Drop overrides: those named, or all with an empty tuple."""

    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SaveLedger:
    radio: str
    entries: tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class SaveStamp:
    stream: str
    stamp: int


@dataclass(frozen=True, slots=True)
class SaveCounter:
    name: str
    value: int


@dataclass(frozen=True, slots=True)
class SaveValue:
    key: str
    text: str


@dataclass(frozen=True, slots=True)
class ForgetValue:
    key: str


@dataclass(frozen=True, slots=True)
class SaveRecord:
    """Keep ``data`` under a name; each owner has its own names, and a version for what it means by the data."""

    name: str
    version: int
    data: Any


@dataclass(frozen=True, slots=True)
class ForgetRecord:
    name: str


@dataclass(frozen=True, slots=True)
class SaveDepth:
    """Tiles of the depth memory as they are now, and keys of tiles that are forgotten."""

    tiles: tuple[tuple[str, bytes], ...]
    gone: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Together:
    """Several changes that happen all or not at all."""

    ops: tuple[StoreOp, ...]


StoreOp = (
    SavePlan
    | SaveParam
    | ForgetParams
    | SaveLedger
    | SaveStamp
    | SaveCounter
    | SaveValue
    | ForgetValue
    | SaveRecord
    | ForgetRecord
    | SaveDepth
    | Together
)


class Completion(NamedTuple):
    """A finished change. ``text`` says why not, or (with ok) that it is kept in memory only.

    Ticket 0 is no change but news of the disk: ``text`` says what is wrong with it, empty when it is well again.
    """

    ticket: int
    ok: bool
    text: str


class StoredRow(NamedTuple):
    """One row as stored; ``body`` None deletes. An empty key with body None deletes the whole section."""

    section: str
    key: str
    body: str | None


def entries_of(op: StoreOp) -> list[StoredRow]:
    """Turn a change into rows."""
    if isinstance(op, SavePlan):
        return [StoredRow("plan", op.kind.name, _items_text(op.items))]
    if isinstance(op, SaveParam):
        return [StoredRow("param", op.name, json.dumps(op.value))]
    if isinstance(op, ForgetParams):
        return [StoredRow("param", name, None) for name in op.names or ("",)]
    if isinstance(op, SaveLedger):
        return [StoredRow("ledger", op.radio, json.dumps(op.entries))]
    if isinstance(op, SaveStamp):
        return [StoredRow("stamp", op.stream, json.dumps(op.stamp))]
    if isinstance(op, SaveCounter):
        return [StoredRow("counter", op.name, json.dumps(op.value))]
    if isinstance(op, SaveValue):
        return [StoredRow("value", op.key, json.dumps(op.text))]
    if isinstance(op, ForgetValue):
        return [StoredRow("value", op.key, None)]
    if isinstance(op, SaveRecord):
        return [StoredRow("record", op.name, json.dumps([op.version, op.data]))]
    if isinstance(op, ForgetRecord):
        return [StoredRow("record", op.name, None)]
    if isinstance(op, SaveDepth):
        tiles = [StoredRow("depth", key, json.dumps(pack_tile(tile))) for key, tile in op.tiles]
        return [*tiles, *(StoredRow("depth", key, None) for key in op.gone)]
    return [entry for part in op.ops for entry in entries_of(part)]


def apply_entries(rows: dict[tuple[str, str], str], entries: list[StoredRow]) -> None:
    """Make a change to rows held in memory."""
    for section, key, body in entries:
        if body is not None:
            rows[section, key] = body
        elif key:
            rows.pop((section, key), None)
        else:
            for each in [found for found in rows if found[0] == section]:
                del rows[each]


def content_of(rows: Mapping[tuple[str, str], str]) -> tuple[StoreContent, list[str]]:
    """Build the content from (section, key) -> body; what cannot be understood is named and left out.

    A section that this version does not know is a newer one's: it stays in the file, and nothing is said.
    """
    sections: dict[str, dict[Any, Any]] = {name: {} for name in SECTIONS}
    strange: list[str] = []
    for (section, key), body in sorted(rows.items()):
        if section not in sections:
            continue
        try:
            name, value = _read(section, key, json.loads(body))
            sections[section][name] = value
        except (ValueError, TypeError, KeyError):
            strange.append(f"{section} {key}")
    return StoreContent(*(sections[name] for name in SECTIONS)), strange


def _read(section: str, key: str, value: Any) -> tuple[Any, Any]:
    if section in ("plan", "old-plan"):
        return PlanKind[key], tuple(PlanItem(*item) for item in value)
    if section == "param":
        return key, float(value)
    if section == "ledger":
        return key, tuple((int(at), int(spent)) for at, spent in value)
    if section in ("stamp", "counter"):
        return key, int(value)
    if section == "record":
        version, data = value
        return key, Record(int(version), data)
    return key, str(value)


def rows_of(content: StoreContent) -> dict[tuple[str, str], str]:
    """The reverse of ``content_of``; also the form in which a recording and an export hold the content."""
    ops: list[StoreOp] = [SavePlan(kind, items) for kind, items in content.plans.items()]
    ops += [SaveParam(name, value) for name, value in content.params.items()]
    ops += [SaveLedger(radio, entries) for radio, entries in content.ledger.items()]
    ops += [SaveStamp(stream, stamp) for stream, stamp in content.stamps.items()]
    ops += [SaveCounter(name, value) for name, value in content.counters.items()]
    ops += [SaveValue(key, text) for key, text in content.values.items()]
    ops += [SaveRecord(name, record.version, record.data) for name, record in content.records.items()]
    rows = {(entry.section, entry.key): entry.body or "" for op in ops for entry in entries_of(op)}
    rows |= {("old-plan", kind.name): _items_text(items) for kind, items in content.old_plans.items()}
    texts = {"depth": content.depth, "old-depth": content.old_depth, "meta": content.meta}
    return rows | {(section, key): json.dumps(text) for section, kept in texts.items() for key, text in kept.items()}


def to_json(content: StoreContent) -> dict[str, dict[str, Any]]:
    """Content as nested plain values: section -> key -> value."""
    found: dict[str, dict[str, Any]] = {}
    for (section, key), body in sorted(rows_of(content).items()):
        found.setdefault(section, {})[key] = json.loads(body)
    return found


def from_json(data: Mapping[str, Mapping[str, Any]]) -> StoreContent:
    """The reverse of ``to_json``; sections and keys that cannot be understood are left out."""
    return content_of(
        {(section, key): json.dumps(value) for section, keys in data.items() for key, value in keys.items()}
    )[0]


def pack_tile(tile: bytes) -> str:
    """A tile of the depth memory as text; most of one is empty."""
    return base64.b64encode(zlib.compress(tile, 1)).decode()


def unpack_tile(text: str, size: int) -> bytes:
    """The reverse; ``ValueError`` when the text is none. Never makes more than ``size`` bytes."""
    try:
        return zlib.decompressobj().decompress(base64.b64decode(text, validate=True), size)
    except zlib.error as error:
        raise ValueError(str(error)) from None


def _items_text(items: tuple[PlanItem, ...]) -> str:
    return json.dumps(
        [[i.command, i.frame, i.param1, i.param2, i.param3, i.param4, i.x, i.y, i.z, i.autocontinue] for i in items]
    )
