"""Small states: what goes with each answer of the vessel, what an answer without a body stands for, and the position that every
version understands.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Final

from ...language.units import e7_to_rad, rad_to_e7
from .bits import BitReader, BitsError, BitWriter
from .state_fields import RadioState, from_level, to_level
from .wire import BRIEF_AIMS, BRIEF_PLANS, MODE, PLAN_STATE

STANDING_BYTES: Final = 2
POSITION_BYTES: Final = 10


def encode_standing(state: RadioState) -> bytes:
    """Two bytes: 4 bits mode, armed, 3 bits state of the plan, 7 bits item, ready to arm."""
    writer = BitWriter()
    writer.put(MODE.number(state.mode), MODE.bits)
    writer.flag(state.armed)
    writer.put(PLAN_STATE.number(state.plan_state), PLAN_STATE.bits)
    writer.put(state.seq % 128, 7)
    writer.flag(state.prearm_ok)
    return writer.bytes()


def with_standing(state: RadioState, body: bytes) -> RadioState:
    """The state with what an answer told. Raises BitsError."""
    reader = BitReader(body[:STANDING_BYTES])
    return replace(
        state,
        mode=MODE.member(reader.get(MODE.bits)),
        armed=reader.flag(),
        plan_state=PLAN_STATE.member(reader.get(PLAN_STATE.bits)),
        seq=reader.get(7),
        prearm_ok=reader.flag(),
    )


def with_brief(state: RadioState, order: bytes, plan: int) -> RadioState:
    """The state after "accepted" to one of ``BRIEF_AIMS``: what it brings, the plan as said, all else as it was. Raises BitsError."""
    if order not in BRIEF_AIMS or plan >= len(BRIEF_PLANS):
        raise BitsError("no such answer")
    aim, plan_state = BRIEF_AIMS[order], BRIEF_PLANS[plan]
    return replace(
        state,
        mode=state.mode if aim is None else aim,
        armed=state.armed or aim is None,
        plan_state=state.plan_state if plan_state is None else plan_state,
    )


def brief_plan(told: RadioState, order: bytes, now: RadioState) -> int | None:
    """What an answer without a body has to say of the plan, so that who was told ``told`` knows how it stands now; None: it would not."""
    wanted = encode_standing(now)
    found = (plan for plan in range(len(BRIEF_PLANS)) if encode_standing(with_brief(told, order, plan)) == wanted)
    return next(found, None)


def encode_position(state: RadioState) -> bytes:
    """Frozen for all versions: latitude and longitude in degrees * 1e7 (an unknown one is -2^31), 0.1 m/s (255 = unknown), 4 bits mode,
    armed, 3 bits 0.
    """
    known = state.lat_rad is not None and state.lon_rad is not None
    lat_e7 = rad_to_e7(state.lat_rad or 0.0) if known else -(1 << 31)
    lon_e7 = rad_to_e7(state.lon_rad or 0.0) if known else 0
    last = MODE.number(state.mode) << 4 | state.armed << 3
    return struct.pack(">iiBB", lat_e7, lon_e7, to_level(state.sog_mps, 0.1, 8), last)


def decode_position(body: bytes) -> RadioState:
    """Raises BitsError for what no encoder makes, and for a mode of a later version."""
    if len(body) != POSITION_BYTES:
        raise BitsError("a position has 10 bytes")
    lat_e7, lon_e7, speed, last = struct.unpack(">iiBB", body)
    known = abs(lat_e7) <= 900_000_000 and abs(lon_e7) <= 1_800_000_000
    return RadioState(
        lat_rad=e7_to_rad(lat_e7) if known else None,
        lon_rad=e7_to_rad(lon_e7) if known else None,
        sog_mps=from_level(speed, 0.1, 8),
        mode=MODE.member(last >> 4),
        armed=bool(last & 8),
    )
