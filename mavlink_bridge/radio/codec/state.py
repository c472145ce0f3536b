"""The vessel's state in 16 bytes (key), 4 bytes (difference to a key that the shore has) or 8 (with another status). Batches are
``batch_codec``, what goes with an answer ``brief_codec``.

Steps are stated with each field. A value that cannot be told within its field's range makes a difference impossible,
and a key is sent instead. Times are the vessel's seconds modulo 4096; a key carries its own only where it may wait aboard,
else the receiver knows it from the arrival. Six bytes after a key or a difference are a threat (``threat``, another vessel).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from .bits import BitReader, BitsError, BitWriter
from .state_fields import (
    CLOCK_S,
    COARSE_SPEED_STEP,
    RadioState,
    from_depth,
    from_tilt,
    from_turn,
    metres_between,
    moved,
    read_change,
    read_position,
    read_status,
    to_depth,
    to_tilt,
    to_turn,
    write_change,
    write_position,
    write_status,
)
from .threat import THREAT_BYTES, decode_threat, encode_threat

KEY_BYTES: Final = 16
TIME_BYTES: Final = 2
"""After a key that may wait aboard."""
DELTA_BYTES: Final = 4
CHANGE_BYTES: Final = 8
"""A difference that brings a status with it: two steps of airtime less than a key, which an order may have to wait for."""
_FAR_M: Final = 180.0
"""Of the 255 m that a difference reaches: what is left is a beacon's time at full speed."""
_KEY_SIZES: Final = frozenset((KEY_BYTES, KEY_BYTES + TIME_BYTES, KEY_BYTES + THREAT_BYTES))


@dataclass(frozen=True, slots=True)
class DeltaParts:
    """What follows the four bytes of a difference: a status, items of the plan that were reached, a threat."""

    changes: bool = False
    reached: int = 0
    threatens: bool = False

    @property
    def size(self) -> int:
        return (CHANGE_BYTES if self.changes else DELTA_BYTES) + self.reached + THREAT_BYTES * self.threatens


_DELTAS: Final = {
    parts.size: parts
    for parts in (
        *(DeltaParts(reached=count) for count in range(4)),
        *(DeltaParts(changes=True, reached=count) for count in range(2)),
        DeltaParts(threatens=True),
        DeltaParts(changes=True, threatens=True),
    )
}
"""By the length of the body: no two are equally long."""


# ---- key ------------------------------------------------------------------------------------------------------------


def encode_key(state: RadioState, mark: int = 0, *, timed: bool = False) -> bytes:
    """16 bytes that stand alone. ``mark`` (0...3) is the name by which differences call it; ``timed``: two bytes of time follow."""
    writer = BitWriter()
    writer.put(mark & 3, 2)
    write_position(writer, state)
    write_status(writer, state)
    writer.put(to_tilt(state.phi_rad), 4)
    writer.put(to_tilt(state.theta_rad), 4)
    writer.put(7 if state.satellites is None else min(max(state.satellites, 0) // 4, 6), 3)
    if timed:
        return writer.bytes() + (state.t_s % CLOCK_S).to_bytes(TIME_BYTES, "big")
    return writer.bytes() + (b"" if state.threat is None else encode_threat(state.threat))


def decode_key(body: bytes) -> RadioState:
    """Raises BitsError for what no encoder makes."""
    if len(body) not in _KEY_SIZES:
        raise BitsError("a key has 16 bytes, and 2 of time or 6 of a threat")
    reader = BitReader(body)
    reader.get(2)
    t_s = int.from_bytes(body[KEY_BYTES:], "big") % CLOCK_S if len(body) == KEY_BYTES + TIME_BYTES else 0
    state = read_status(reader, read_position(reader, RadioState(t_s=t_s)))
    state = replace(state, phi_rad=from_tilt(reader.get(4)), theta_rad=from_tilt(reader.get(4)))
    satellites = reader.get(3)
    threat = decode_threat(body[KEY_BYTES:]) if len(body) == KEY_BYTES + THREAT_BYTES else None
    return replace(state, satellites=None if satellites == 7 else 4 * satellites, threat=threat)


def settle(state: RadioState) -> RadioState:
    """The state as the shore will see it."""
    return decode_key(encode_key(state))


# ---- difference to a key --------------------------------------------------------------------------------------------


def encode_delta(
    key: RadioState, key_mark: int, state: RadioState, *, says_status: bool = False, reached: bytes = b""
) -> bytes | None:
    """Four bytes against ``key`` as the shore has it (settled); None when the change does not fit. Another status needs four more, and
    so does readiness that has changed (``says_status``); of the items ``reached`` go as many as there is room for.

    2 bits mark of the key, 9 + 9 bits north and east in metres, 6 bits heading, 4 bits speed in 0.25 m/s, 2 bits depth step.
    """
    offset = metres_between(key, state)
    changed = says_status or state.status != key.status
    if offset is None or state.sog_mps is None:
        return None
    north, east = round(offset[0]) + 256, round(offset[1]) + 256
    depth = to_depth(state.alt_m) - to_depth(key.alt_m)
    speed = round(state.sog_mps / COARSE_SPEED_STEP)
    known = (state.alt_m is None) == (key.alt_m is None)
    if not (0 <= north < 512 and 0 <= east < 512 and 0 <= speed < 16 and known):
        return None
    writer = BitWriter()
    writer.put(key_mark & 3, 2)
    writer.put(north, 9)
    writer.put(east, 9)
    writer.put(to_turn(state.psi_rad, 6), 6)
    writer.put(speed, 4)
    # shoaling must never be hidden by a narrow field: beyond a step either way a key is due
    if not -1 <= depth <= 2:
        return None
    writer.put(depth + 1, 2)
    if changed:
        write_change(writer, state)
    if state.threat is not None:
        return writer.bytes() + encode_threat(state.threat)
    room = max(parts.reached for parts in _DELTAS.values() if parts.changes is changed)
    return writer.bytes() + reached[:room]


def mark_of(body: bytes) -> int:
    """Which key this is, or this difference belongs to."""
    return body[0] >> 6 if body else -1


def as_key_mark(mark: int) -> int:
    """The mark under which a difference to the key ``mark`` serves as a key itself, once the shore has named it."""
    return (mark + 2) % 4


def is_near_the_end(key: RadioState, state: RadioState) -> bool:
    """Whether the next state may be too far from the key for a difference."""
    offset = metres_between(key, state)
    return offset is None or max(map(abs, offset)) > _FAR_M or not 0 <= to_depth(state.alt_m) - to_depth(key.alt_m) <= 1


def delta_parts(body: bytes) -> DeltaParts:
    """What a difference brings with it."""
    return _DELTAS.get(len(body), DeltaParts())


def reached_in(body: bytes) -> bytes:
    """The items reached that a difference tells of, their low eight bits each."""
    count = delta_parts(body).reached
    return body[-count:] if count else b""


def decode_delta(key: RadioState, body: bytes) -> RadioState:
    """Raises BitsError."""
    if len(body) not in _DELTAS or key.lat_rad is None:
        raise BitsError("no key for this difference")
    parts = _DELTAS[len(body)]
    reader = BitReader(body)
    reader.get(2)
    lat_rad, lon_rad = moved(key, reader.get(9) - 256.0, reader.get(9) - 256.0)
    psi_rad = from_turn(reader.get(6), 6)
    speed = reader.get(4) * COARSE_SPEED_STEP
    alt_m = None if key.alt_m is None else from_depth(min(max(to_depth(key.alt_m) + reader.get(2) - 1, 0), 126))
    threat = decode_threat(body[-THREAT_BYTES:]) if parts.threatens else None
    key = read_change(reader, key) if parts.changes else key
    return replace(key, lat_rad=lat_rad, lon_rad=lon_rad, psi_rad=psi_rad, sog_mps=speed, alt_m=alt_m, threat=threat)
