"""Messages about systems and their parts: presence, entities and their parameters, logs, texts."""

from __future__ import annotations

from typing import ClassVar

from ..fields import F32, F64, I8, I16, U8, U16, U32, ListOf, Message, Raw, Text, message


@message
class EntityState(Message):
    """How one part of a system is, in words."""

    NUMBER: ClassVar[int] = 1
    state: U8 = 0
    """An ``EntityCondition``."""
    flags: U8 = 0
    """1: somebody must look."""
    description: Text = ""


@message
class EntityInfo(Message):
    NUMBER: ClassVar[int] = 3
    id: U8 = 0
    label: Text = ""
    component: Text = ""
    act_time_s: U16 = 0
    deact_time_s: U16 = 0


@message
class EntityList(Message):
    """Names of a system's entities: ``Daemon=0;Navigation=1``."""

    NUMBER: ClassVar[int] = 5
    op: U8 = 0
    """An ``EntityListOp``."""
    list: Text = ""


@message
class CpuUsage(Message):
    NUMBER: ClassVar[int] = 7
    value_pct: U8 = 0


@message
class EntityActivationState(Message):
    NUMBER: ClassVar[int] = 14
    state: U8 = 0
    """An ``Activation``."""
    error: Text = ""


@message
class StorageUsage(Message):
    NUMBER: ClassVar[int] = 100
    available_mib: U32 = 0
    value_pct: U8 = 0


@message
class LoggingControl(Message):
    NUMBER: ClassVar[int] = 102
    op: U8 = 0
    """A ``LoggingOp``."""
    name: Text = ""


@message
class LogBookEntry(Message):
    """One line of a system's log book."""

    NUMBER: ClassVar[int] = 103
    type: U8 = 0
    """A ``LogBookType``."""
    htime_s: F64 = 0.0
    """UTC, s since 1970."""
    context: Text = ""
    text: Text = ""


@message
class LogBookControl(Message):
    NUMBER: ClassVar[int] = 104
    command: U8 = 0
    """A ``LogBookCommand``."""
    htime_s: F64 = 0.0
    """Entries newer than this are wanted; in a reply the time of the reply. UTC, s since 1970."""
    msg: ListOf[LogBookEntry] = ()


@message
class Heartbeat(Message):
    NUMBER: ClassVar[int] = 150


@message
class Announce(Message):
    """Who a system is, where, and by which addresses it can be spoken to."""

    NUMBER: ClassVar[int] = 151
    sys_name: Text = ""
    sys_type: U8 = 0
    """A ``SystemType``."""
    owner: U16 = 0xFFFF
    """Id of the system that owns this one; 0xFFFF nobody."""
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    height_m: F32 = 0.0
    services: Text = ""
    """Addresses as URLs with ``;`` between them."""


@message
class TextMessage(Message):
    NUMBER: ClassVar[int] = 160
    origin: Text = ""
    text: Text = ""


@message
class LblBeacon(Message):
    NUMBER: ClassVar[int] = 202
    beacon: Text = ""
    lat_rad: F64 = 0.0
    lon_rad: F64 = 0.0
    depth_m: F32 = 0.0
    query_channel: U8 = 0
    reply_channel: U8 = 0
    transponder_delay_ms: U8 = 0


@message
class LblConfig(Message):
    NUMBER: ClassVar[int] = 203
    op: U8 = 0
    """An ``LblOp``."""
    beacons: ListOf[LblBeacon] = ()


@message
class StateReport(Message):
    """A system's state in 24 bytes, for slow links."""

    NUMBER: ClassVar[int] = 514
    stime_s: U32 = 0
    """UTC, whole s since 1970."""
    latitude_deg: F32 = 0.0
    longitude_deg: F32 = 0.0
    altitude_dm: U16 = 0xFFFF
    """0xFFFF unknown."""
    depth_dm: U16 = 0xFFFF
    """0xFFFF unknown."""
    heading: U16 = 0
    """A turn is 65 535 steps, clockwise from true north."""
    speed_cmps: I16 = 0
    fuel_pct: I8 = -1
    """-1 unknown."""
    exec_state_pct: I8 = -1
    """Progress of the plan; -1 service, -2 boot, -3 calibration, -4 error."""
    plan_checksum: U16 = 0


@message
class EntityParameter(Message):
    NUMBER: ClassVar[int] = 801
    name: Text = ""
    value: Text = ""


@message
class EntityParameters(Message):
    """The answer to a query: what an entity's parameters are now."""

    NUMBER: ClassVar[int] = 802
    name: Text = ""
    """Label of the entity."""
    params: ListOf[EntityParameter] = ()


@message
class QueryEntityParameters(Message):
    NUMBER: ClassVar[int] = 803
    name: Text = ""
    visibility: Text = ""
    scope: Text = ""


@message
class SetEntityParameters(Message):
    NUMBER: ClassVar[int] = 804
    name: Text = ""
    params: ListOf[EntityParameter] = ()


@message
class SaveEntityParameters(Message):
    NUMBER: ClassVar[int] = 805
    name: Text = ""


@message
class MessagePart(Message):
    """A piece of a packet that was too long for its carrier."""

    NUMBER: ClassVar[int] = 877
    uid: U8 = 0
    frag_number: U8 = 0
    num_frags: U8 = 0
    data: Raw = b""
