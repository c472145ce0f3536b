"""What the shore must know besides the state: which plans, parameters and home the vessel has, and how it asks for them."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntFlag
from zlib import crc32

from ...language.requests import PlanKind
from ...mavlink.persona import ParamInfo, ParamTable, VehiclePort
from .request import name_code

_KEPT_FORM = struct.Struct("<BIIIH")
_PLACE_FORM = struct.Struct("<Bii3B")
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
_KEPT, _PARAMS, _PLACE = 1, 2, 3


@dataclass(frozen=True, slots=True)
class Kept:
    """Identity of the plans and parameters that the vessel keeps; 23 bytes on the air."""

    mission_id: int = 0
    fence_id: int = 0
    rally_id: int = 0
    params: int = 0
    """CRC-16 over the names and values that differ from their defaults."""

    def plan_id(self, kind: PlanKind) -> int:
        return (self.mission_id, self.fence_id, self.rally_id)[kind.value]

    def has_plans_of(self, other: Kept) -> bool:
        """Whether plan, fence and rally points are the other's."""
        return all(self.plan_id(kind) == other.plan_id(kind) for kind in PlanKind)

    def with_plan(self, kind: PlanKind, number: int) -> Kept:
        """The same with one plan changed."""
        ids = [self.mission_id, self.fence_id, self.rally_id]
        ids[kind.value] = number
        return replace(self, mission_id=ids[0], fence_id=ids[1], rally_id=ids[2])


@dataclass(frozen=True, slots=True)
class HomePlace:
    """Where the vessel's home is, and its software's version; 20 bytes on the air."""

    home_e7: tuple[int, int] | None = None
    version: tuple[int, int, int] = (0, 0, 0)

    def is_like(self, other: HomePlace) -> bool:
        """Whether who knows the other need not be told this one."""
        if self.home_e7 is None or other.home_e7 is None:
            return self == other
        steps = max(abs(mine - theirs) for mine, theirs in zip(self.home_e7, other.home_e7, strict=True))
        return self.version == other.version and steps <= _SAME_HOME_E7


_SAME_HOME_E7 = 100
"""A metre: at each arming home is a little beside the last one, by the receiver's noise."""


def changed_params(table: ParamTable) -> dict[int, float]:
    """The parameters that differ from their defaults, by name code."""
    infos = (table.at(index) for index in range(len(table)))
    return {name_code(info.name): info.value for info in infos if info is not None and _differs(info)}


def params_check(changed: Mapping[int, float]) -> int:
    """Low 16 bits of a CRC over what differs from the defaults: a shore that has a shorter table can keep that too."""
    return crc32(b"".join(_PARAM.pack(code, value) for code, value in sorted(changed.items()))) & 0xFFFF


def kept_by(vehicle: VehiclePort) -> Kept:
    """Collect it from the vessel."""
    plans = vehicle.plans
    return Kept(
        mission_id=plans.plan_id(PlanKind.MISSION),
        fence_id=plans.plan_id(PlanKind.FENCE),
        rally_id=plans.plan_id(PlanKind.RALLY),
        params=params_check(changed_params(vehicle.params)),
    )


def encode(told: Kept | HomePlace) -> bytes:
    """One message each: together they would be on the air longer than an order should have to wait."""
    if isinstance(told, Kept):
        return _KEPT_FORM.pack(_KEPT, told.mission_id, told.fence_id, told.rally_id, told.params)
    lat, lon = told.home_e7 or (_NO_HOME, 0)
    return _PLACE_FORM.pack(_PLACE, lat, lon, *(min(part, 255) for part in told.version))


def encode_params(table: ParamTable) -> bytes:
    """The parameters that differ from their defaults."""
    return bytes((_PARAMS,)) + b"".join(_PARAM.pack(code, value) for code, value in changed_params(table).items())


def _differs(info: ParamInfo) -> bool:
    return info.default is None or struct.pack("<f", info.value) != struct.pack("<f", info.default)


def decode(payload: bytes) -> Kept | HomePlace | dict[int, float] | None:
    """What the vessel keeps, where its home is, or parameters by name code; None for none of them."""
    code, size = payload[:1], len(payload)
    if code == bytes((_KEPT,)) and size == _KEPT_FORM.size:
        return Kept(*_KEPT_FORM.unpack(payload)[1:])
    if code == bytes((_PLACE,)) and size == _PLACE_FORM.size:
        _, lat, lon, major, minor, patch = _PLACE_FORM.unpack(payload)
        return HomePlace(None if lat == _NO_HOME else (lat, lon), (major, minor, patch))
    if code == bytes((_PARAMS,)) and (size - 1) % _PARAM.size == 0:
        return dict(_PARAM.iter_unpack(payload[1:]))
    return None
