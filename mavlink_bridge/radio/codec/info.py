"""What the shore must know besides the state: which plans, parameters and home the vessel has, and how it asks for them."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from enum import IntFlag
from zlib import crc32

from ...language.requests import PlanKind
from ...mavlink.persona import ParamInfo, ParamTable, VehiclePort
from .request import name_code

_FORMAT = struct.Struct("<BIIIHii3B")
_PARAM = struct.Struct("<Hf")
_NO_HOME = -0x8000_0000


class Wanted(IntFlag):
    """What the shore asks for."""

    INFO = 1
    PARAMS = 2
    MISSION = 4
    FENCE = 8
    RALLY = 16


WANTED_PLAN = {PlanKind.MISSION: Wanted.MISSION, PlanKind.FENCE: Wanted.FENCE, PlanKind.RALLY: Wanted.RALLY}
_INFO, _PARAMS = 1, 2


@dataclass(frozen=True, slots=True)
class Info:
    """Identity of what the vessel keeps; 26 bytes on the air."""

    mission_id: int = 0
    fence_id: int = 0
    rally_id: int = 0
    params: int = 0
    """CRC-16 over all names and values."""
    home_e7: tuple[int, int] | None = None
    version: tuple[int, int, int] = (0, 0, 0)

    def plan_id(self, kind: PlanKind) -> int:
        return (self.mission_id, self.fence_id, self.rally_id)[kind.value]

    def with_plan(self, kind: PlanKind, number: int) -> Info:
        """The same with one plan changed."""
        ids = [self.mission_id, self.fence_id, self.rally_id]
        ids[kind.value] = number
        return replace(self, mission_id=ids[0], fence_id=ids[1], rally_id=ids[2])


def params_check(table: ParamTable) -> int:
    """Low 16 bits of a CRC over the whole table."""
    infos = (table.at(index) for index in range(len(table)))
    data = b"".join(info.name.encode() + struct.pack("<f", info.value) for info in infos if info is not None)
    return crc32(data) & 0xFFFF


def info_of(vehicle: VehiclePort, home_e7: tuple[int, int] | None) -> Info:
    """Collect it from the vessel."""
    plans = vehicle.plans
    return Info(
        mission_id=plans.plan_id(PlanKind.MISSION),
        fence_id=plans.plan_id(PlanKind.FENCE),
        rally_id=plans.plan_id(PlanKind.RALLY),
        params=params_check(vehicle.params),
        home_e7=home_e7,
        version=vehicle.identity.version,
    )


def encode_info(info: Info) -> bytes:
    lat, lon = info.home_e7 or (_NO_HOME, 0)
    major, minor, patch = (min(part, 255) for part in info.version)
    return _FORMAT.pack(
        _INFO, info.mission_id, info.fence_id, info.rally_id, info.params, lat, lon, major, minor, patch
    )


def encode_params(table: ParamTable) -> bytes:
    """The parameters that differ from their defaults."""
    infos = (table.at(index) for index in range(len(table)))
    changed = (info for info in infos if info is not None and _differs(info))
    return bytes((_PARAMS,)) + b"".join(_PARAM.pack(name_code(info.name), info.value) for info in changed)


def _differs(info: ParamInfo) -> bool:
    return info.default is None or struct.pack("<f", info.value) != struct.pack("<f", info.default)


def decode(payload: bytes) -> Info | dict[int, float] | None:
    """An ``Info``, or parameters by name code; None for neither."""
    if payload[:1] == bytes((_INFO,)) and len(payload) == _FORMAT.size:
        _, mission, fence, rally, params, lat, lon, *version = _FORMAT.unpack(payload)
        home = None if lat == _NO_HOME else (lat, lon)
        return Info(
            mission_id=mission,
            fence_id=fence,
            rally_id=rally,
            params=params,
            home_e7=home,
            version=(version[0], version[1], version[2]),
        )
    if payload[:1] == bytes((_PARAMS,)) and (len(payload) - 1) % _PARAM.size == 0:
        return dict(_PARAM.iter_unpack(payload[1:]))
    return None
