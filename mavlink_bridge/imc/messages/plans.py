"""Messages about plans: what a plan is, the vehicle's collection of them, and their execution."""

from __future__ import annotations

from typing import ClassVar

from ..fields import F32, F64, I32, U8, U16, U32, Inline, ListOf, Message, Raw, Text, message


@message
class PlanVariable(Message):
    NUMBER: ClassVar[int] = 561
    name: Text = ""
    value: Text = ""
    type: U8 = 0
    """A ``VariableType``."""
    access: U8 = 0
    """A ``VariableAccess``."""


@message
class PlanManeuver(Message):
    """One node of a plan: a manoeuvre under its name."""

    NUMBER: ClassVar[int] = 552
    maneuver_id: Text = ""
    data: Inline = None
    start_actions: ListOf[Message] = ()
    end_actions: ListOf[Message] = ()


@message
class PlanTransition(Message):
    NUMBER: ClassVar[int] = 553
    source_man: Text = ""
    dest_man: Text = ""
    conditions: Text = ""
    """``ManeuverIsDone`` is the only one that consoles write."""
    actions: ListOf[Message] = ()


@message
class PlanSpecification(Message):
    NUMBER: ClassVar[int] = 551
    plan_id: Text = ""
    description: Text = ""
    vnamespace: Text = ""
    variables: ListOf[PlanVariable] = ()
    start_man_id: Text = ""
    maneuvers: ListOf[PlanManeuver] = ()
    transitions: ListOf[PlanTransition] = ()
    start_actions: ListOf[Message] = ()
    end_actions: ListOf[Message] = ()


@message
class PlanDB(Message):
    """A request about the vehicle's plans, or the answer to one."""

    NUMBER: ClassVar[int] = 556
    type: U8 = 0
    """A ``ReplyType``."""
    op: U8 = 0
    """A ``PlanDBOp``."""
    request_id: U16 = 0
    plan_id: Text = ""
    arg: Inline = None
    info: Text = ""


@message
class PlanDBInformation(Message):
    NUMBER: ClassVar[int] = 558
    plan_id: Text = ""
    plan_size: U16 = 0
    """Bytes of the plan's fields."""
    change_time_s: F64 = 0.0
    """UTC, s since 1970."""
    change_sid: U16 = 0
    change_sname: Text = ""
    md5: Raw = b""
    """Of the plan's fields, little-endian, without header and CRC."""


@message
class PlanDBState(Message):
    NUMBER: ClassVar[int] = 557
    plan_count: U16 = 0
    plan_size: U32 = 0
    change_time_s: F64 = 0.0
    change_sid: U16 = 0
    change_sname: Text = ""
    md5: Raw = b""
    """Of the plans' own sums, one after the other in the order of their names."""
    plans_info: ListOf[PlanDBInformation] = ()


@message
class PlanControl(Message):
    """A request about the execution of a plan, or the answer to one."""

    NUMBER: ClassVar[int] = 559
    type: U8 = 0
    """A ``ReplyType``."""
    op: U8 = 0
    """A ``PlanControlOp``."""
    request_id: U16 = 0
    plan_id: Text = ""
    flags: U16 = 0
    """``PlanFlags``."""
    arg: Inline = None
    info: Text = ""


@message
class PlanControlState(Message):
    NUMBER: ClassVar[int] = 560
    state: U8 = 0
    """A ``PlanState``."""
    plan_id: Text = ""
    plan_eta_s: I32 = -1
    """-1 unknown."""
    plan_progress_pct: F32 = -1.0
    """-1 unknown."""
    man_id: Text = ""
    man_type: U16 = 0xFFFF
    """Number of the manoeuvre's message; 0xFFFF none."""
    man_eta_s: I32 = -1
    """-1 unknown."""
    last_outcome: U8 = 0
    """An ``Outcome``."""


@message
class PlanStatistics(Message):
    NUMBER: ClassVar[int] = 564
    plan_id: Text = ""
    type: U8 = 0
    """A ``StatisticsType``."""
    properties: U8 = 0
    """``StatisticsProperties``."""
    durations: Text = ""
    distances: Text = ""
    actions: Text = ""
    fuel: Text = ""
