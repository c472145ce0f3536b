"""What was transferred, out of a telemetry log: the last complete plan of each kind, up or down, and the parameters, of any vehicle."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

from mavlink_bridge.language.requests import PlanItem, PlanKind
from mavlink_bridge.language.units import e7_to_rad
from mavlink_bridge.mavlink.missions.wire import home_problem, item_from_message, kind_of, without_home
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode, dialect
from mavlink_bridge.plans import PlanFile

from ...io.log_file import parts_of
from ...report.from_run import read_run
from ...settings import ConfigError
from ...settings.device import no_device
from .params import PackedParams

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


def plan_from_run(run_dir: Path) -> PlanFile:
    """A run's plans: what came over its links, else what its own people or its store gave it."""
    data = b"".join(part.read_bytes() for part in parts_of(run_dir / "mavlink.tlog"))
    sent = plan_from_tlog(data)
    if sent.mission or sent.fence or sent.rally:
        return sent
    flight = read_run(run_dir)
    return PlanFile(flight.plan, flight.fence, flight.rally, None, "run directory")


def params_from_tlog(data: bytes) -> str:
    """Every parameter that a vehicle told of itself, its last value, as QGroundControl's parameter file; empty without any.

    Told one by one, or fetched as one file.
    """
    found: dict[tuple[int, int, str], tuple[float, int]] = {}
    packed = PackedParams()
    bytewise: set[int] = set()
    for record in tlog.iterate(data):
        if record.frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            if record.frame.payload.ljust(6, b"\0")[5] == dialect.MAV_AUTOPILOT_PX4:
                bytewise.add(record.frame.system)
        elif record.frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
            message = decode(record.frame)
            if message is not None:
                key = (record.frame.system, record.frame.component, message.param_id)
                found[key] = message.param_value, message.param_type
        elif record.frame.message_id == dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            message = decode(record.frame)
            sender = (record.frame.system, record.frame.component)
            values = packed.take(sender, message) if message is not None else None
            found.update({(*sender, name): value for name, value in (values or {}).items()})
    lines = [
        f"{system}\t{component}\t{name}\t{_number(value, kind, system in bytewise)}\t{kind}"
        for (system, component, name), (value, kind) in sorted(found.items())
    ]
    return "\n".join(["# Vehicle-Id Component-Id Name Value Type", *lines, ""]) if lines else ""


def _number(value: float, kind: int, bytewise: bool) -> str:
    """A value in words; PX4 puts the bytes of a whole number into the field, others its value."""
    if kind == dialect.MAV_PARAM_TYPE_REAL32 or not math.isfinite(value):
        return f"{value:.9g}"
    if bytewise and kind == dialect.MAV_PARAM_TYPE_INT32:
        return str(struct.unpack("<i", struct.pack("<f", value))[0])
    return str(round(value))


def _plan_file(plans: dict[PlanKind, tuple[PlanItem, ...]], *, ardupilot: bool) -> PlanFile:
    mission, home = plans.get(PlanKind.MISSION, ()), None
    if ardupilot and mission and not home_problem(mission[0]):
        home = (e7_to_rad(mission[0].x), e7_to_rad(mission[0].y))
        mission = without_home(mission)
    return PlanFile(mission, plans.get(PlanKind.FENCE, ()), plans.get(PlanKind.RALLY, ()), home, "telemetry log")


def plan_in(source: Path) -> PlanFile:
    """The plans that were transferred in a log or a run. Raises ConfigError for what is neither, OSError."""
    return plan_from_run(source) if source.is_dir() else plan_from_tlog(_log(source))


def _log(source: Path) -> bytes:
    """The bytes of a telemetry log. Raises ConfigError for a file that is none, OSError."""
    data = no_device(source).read_bytes()
    what = tlog.not_a_log(data)
    if what:
        raise ConfigError(str(source), [f"{what}; give a telemetry log or a run directory"])
    return data


def params_in(source: Path) -> str:
    """The parameters that a log or a run tells. Raises ConfigError for what is neither, OSError."""
    if source.is_file():
        return params_from_tlog(_log(source))
    parts = parts_of(source / "mavlink.tlog")
    if not parts:
        raise ConfigError(str(source), ["holds no telemetry log"])
    return params_from_tlog(b"".join(part.read_bytes() for part in parts))
