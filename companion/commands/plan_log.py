"""Plans out of a telemetry log: the last complete transfer of each kind, up or down, to or from any vehicle."""

from __future__ import annotations

import math
from typing import Any

from mavlink_bridge import tlog
from mavlink_bridge.codec import decode, dialect
from mavlink_bridge.mission_wire import home_problem, item_from_message, kind_of, without_home
from mavlink_bridge.planfile import PlanFile
from mavlink_bridge.requests import PlanItem, PlanKind

_ARDUPILOT = 3


class _Transfer:
    """Items that follow a MISSION_COUNT in one direction."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.items: dict[int, PlanItem] = {}

    def take(self, message: Any) -> tuple[PlanItem, ...] | None:
        """Keep an item; all of them once none is missing."""
        if message.seq < self.count:
            self.items[message.seq] = item_from_message(message)
        if len(self.items) < self.count:
            return None
        return tuple(self.items[seq] for seq in range(self.count))


def plan_from_tlog(data: bytes) -> PlanFile:
    """Everything that was transferred whole. An ArduPilot's home item is taken off and becomes the planned home."""
    wanted = {
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_MISSION_COUNT,
        dialect.MAVLINK_MSG_ID_MISSION_ITEM,
        dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT,
    }
    transfers: dict[tuple[int, int, int], _Transfer] = {}
    plans: dict[PlanKind, tuple[PlanItem, ...]] = {}
    ardupilot = False
    for record in tlog.iterate(data):
        if record.frame.message_id not in wanted:
            continue
        message = decode(record.frame)
        if message is None:
            continue
        if message.get_type() == "HEARTBEAT":
            ardupilot |= message.autopilot == _ARDUPILOT
            continue
        kind = kind_of(message.mission_type)
        key = (record.frame.system, record.frame.component, message.mission_type)
        if kind is None:
            continue
        if message.get_type() == "MISSION_COUNT":
            transfers[key] = _Transfer(message.count)
        elif key in transfers and message.current < 2:
            items = transfers[key].take(message)
            if items is not None:
                plans[kind] = items
    return _plan_file(plans, ardupilot=ardupilot)


def _plan_file(plans: dict[PlanKind, tuple[PlanItem, ...]], *, ardupilot: bool) -> PlanFile:
    mission, home = plans.get(PlanKind.MISSION, ()), None
    if ardupilot and mission and not home_problem(mission[0]):
        home = (math.radians(mission[0].x / 1e7), math.radians(mission[0].y / 1e7))
        mission = without_home(mission)
    return PlanFile(mission, plans.get(PlanKind.FENCE, ()), plans.get(PlanKind.RALLY, ()), home, "telemetry log")
