"""The vessel's state in 17 bytes (key), 4 bytes (difference to a key that the shore has) or 14 samples in 56 bytes
(batch).

Steps are stated with each field. A value that cannot be told within its field's range makes a difference impossible,
and a key is sent instead. Times are the vessel's seconds modulo 4096; the receiver of a single state knows its time
from its arrival.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

from ...language.messages import Action, FixType, GuardState, Mode, PlanState
from ...language.snapshot import Snapshot
from .bits import BitReader, BitsError, BitWriter

KEY_BYTES: Final = 17
DELTA_BYTES: Final = 4
BATCH_SAMPLES: Final = 14
CLOCK_S: Final = 4096
_MODES: Final = tuple(Mode)
_LAT_STEP_DEG: Final = 180.0 / 2**26
_LON_STEP_DEG: Final = 360.0 / 2**27
_EARTH_M: Final = 111_320.0
_SPEED_STEP: Final = 0.05
_DELTA_SPEED_STEP: Final = 0.25
_SCALES_M: Final = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
_ANGLE_STEP_RAD: Final = math.radians(4.0)
_ALT_BASE_M: Final = 0.1
_ALT_FACTOR: Final = 1.07


@dataclass(frozen=True, slots=True)
class RadioState:
    """What a state packet tells. Unknown is None; values are those of the steps once they have been through the codec."""

    t_s: int = 0
    """Vessel's clock, modulo 4096 s."""
    lat_rad: float | None = None
    lon_rad: float | None = None
    """Steps of 0.3 m."""
    sog_mps: float | None = None
    """Steps of 0.05 m/s, up to 12.7 m/s."""
    psi_rad: float | None = None
    """Steps of 1.4 degrees."""
    phi_rad: float | None = None
    theta_rad: float | None = None
    """Steps of 4 degrees, within 28 degrees."""
    alt_m: float | None = None
    """Water under the keel, steps of 7 %, from 0.1 m to 500 m."""
    mode: Mode = Mode.HOLD
    armed: bool = False
    action: Action = Action.NONE
    guard: GuardState = GuardState.UNKNOWN
    plan_state: PlanState = PlanState.NO_MISSION
    seq: int = 0
    """Modulo 128."""
    plan_hash: int = 0
    """Low six bits of the plan's CRC-32."""
    battery: float | None = None
    """Share of the charge, steps of 1/62."""
    fix: FixType = FixType.NONE
    gps_ok: bool = False
    heading_ok: bool = False
    actuators_ok: bool = False
    prearm_ok: bool = False

    @classmethod
    def of(cls, snapshot: Snapshot) -> RadioState:
        """Take what the radio tells out of the vessel's picture of itself."""
        state, health = snapshot.state, snapshot.health
        return cls(
            t_s=snapshot.t_us // 1_000_000 % CLOCK_S,
            lat_rad=state.lat_rad,
            lon_rad=state.lon_rad,
            sog_mps=state.sog_mps,
            psi_rad=state.psi_rad,
            phi_rad=state.phi_rad,
            theta_rad=state.theta_rad,
            alt_m=state.alt_m,
            mode=snapshot.mode,
            armed=snapshot.armed,
            action=snapshot.action,
            guard=snapshot.guard,
            plan_state=snapshot.progress.state,
            seq=snapshot.progress.seq % 128,
            plan_hash=snapshot.progress.mission_id & 0x3F,
            battery=snapshot.supply.remaining if snapshot.supply else None,
            fix=state.fix_type,
            gps_ok=health.gps,
            heading_ok=health.heading,
            actuators_ok=health.actuators,
            prearm_ok=health.prearm_ok,
        )

    @property
    def status(self) -> tuple[object, ...]:
        """What must be told at once when it changes."""
        return (self.mode, self.armed, self.action, self.guard, self.plan_state, self.seq, self.plan_hash)


# ---- scalars: each to a code of its width, 'unknown' being the highest code -----------------------------------------


def _level(value: float | None, step: float, width: int) -> int:
    """Unsigned steps; more than fits is the largest value."""
    top = (1 << width) - 1
    if value is None or not math.isfinite(value):
        return top
    return min(max(round(value / step), 0), top - 1)


def _from_level(code: int, step: float, width: int) -> float | None:
    return None if code == (1 << width) - 1 else code * step


def _turn(angle_rad: float | None, width: int) -> int:
    """A heading; the highest code means unknown."""
    count = (1 << width) - 1
    if angle_rad is None or not math.isfinite(angle_rad):
        return count
    return round(angle_rad / math.tau * count) % count


def _from_turn(code: int, width: int) -> float | None:
    count = (1 << width) - 1
    return None if code == count else (code / count * math.tau + math.pi) % math.tau - math.pi


def _tilt(angle_rad: float | None) -> int:
    if angle_rad is None or not math.isfinite(angle_rad):
        return 15
    return min(max(round(angle_rad / _ANGLE_STEP_RAD), -7), 7) + 7


def _from_tilt(code: int) -> float | None:
    return None if code == 15 else (code - 7) * _ANGLE_STEP_RAD


def _depth(alt_m: float | None) -> int:
    """Logarithmic: 0 = 0.1 m or less, 126 = 500 m or more, 127 = unknown."""
    if alt_m is None or not math.isfinite(alt_m):
        return 127
    return min(max(round(math.log(max(alt_m, _ALT_BASE_M) / _ALT_BASE_M) / math.log(_ALT_FACTOR)), 0), 126)


def _from_depth(code: int) -> float | None:
    return None if code == 127 else _ALT_BASE_M * float(_ALT_FACTOR**code)


def _grid(state: RadioState) -> tuple[int, int]:
    """Position on the key's grid; the last latitude means unknown."""
    if state.lat_rad is None or state.lon_rad is None:
        return 2**26 - 1, 0
    lat = round((math.degrees(state.lat_rad) + 90.0) / _LAT_STEP_DEG)
    lon = round((math.degrees(state.lon_rad) + 180.0) / _LON_STEP_DEG)
    return min(max(lat, 0), 2**26 - 2), lon % 2**27


def _from_grid(lat: int, lon: int) -> tuple[float | None, float | None]:
    if lat == 2**26 - 1:
        return None, None
    return math.radians(lat * _LAT_STEP_DEG - 90.0), math.radians(lon * _LON_STEP_DEG - 180.0)


# ---- key ------------------------------------------------------------------------------------------------------------


def encode_key(state: RadioState, mark: int = 0) -> bytes:
    """17 bytes that stand alone. ``mark`` (0...3) is the name by which differences call it."""
    writer = BitWriter()
    writer.put(mark & 3, 2)
    writer.put(state.t_s % CLOCK_S, 12)
    _write_position(writer, state)
    _write_status(writer, state)
    writer.put(_tilt(state.phi_rad), 4)
    writer.put(_tilt(state.theta_rad), 4)
    return writer.bytes()


def decode_key(body: bytes) -> RadioState:
    """Raises BitsError for what no encoder makes."""
    if len(body) != KEY_BYTES:
        raise BitsError("a key has 17 bytes")
    reader = BitReader(body)
    reader.get(2)
    state = _read_status(reader, _read_position(reader, RadioState(t_s=reader.get(12))))
    return replace(state, phi_rad=_from_tilt(reader.get(4)), theta_rad=_from_tilt(reader.get(4)))


def settle(state: RadioState) -> RadioState:
    """The state as the shore will see it."""
    return decode_key(encode_key(state))


def _write_position(writer: BitWriter, state: RadioState) -> None:
    lat, lon = _grid(state)
    writer.put(lat, 26)
    writer.put(lon, 27)
    writer.put(_level(state.sog_mps, _SPEED_STEP, 8), 8)
    writer.put(_turn(state.psi_rad, 8), 8)


def _read_position(reader: BitReader, state: RadioState) -> RadioState:
    lat_rad, lon_rad = _from_grid(reader.get(26), reader.get(27))
    speed, turn = reader.get(8), reader.get(8)
    return replace(
        state,
        lat_rad=lat_rad,
        lon_rad=lon_rad,
        sog_mps=_from_level(speed, _SPEED_STEP, 8),
        psi_rad=_from_turn(turn, 8),
    )


def _write_status(writer: BitWriter, state: RadioState) -> None:
    writer.put(_depth(state.alt_m), 7)
    writer.put(_MODES.index(state.mode), 3)
    writer.flag(state.armed)
    writer.put(state.action, 3)
    writer.put(state.guard, 2)
    writer.put(state.plan_state, 3)
    writer.put(state.seq % 128, 7)
    writer.put(state.plan_hash & 0x3F, 6)
    writer.put(_level(state.battery, 1.0 / 62.0, 6), 6)
    writer.put(state.fix, 3)
    for flag in (state.gps_ok, state.heading_ok, state.actuators_ok, state.prearm_ok):
        writer.flag(flag)


def _read_status(reader: BitReader, state: RadioState) -> RadioState:
    try:
        return replace(
            state,
            alt_m=_from_depth(reader.get(7)),
            mode=_MODES[reader.get(3)],
            armed=reader.flag(),
            action=Action(reader.get(3)),
            guard=GuardState(reader.get(2)),
            plan_state=PlanState(reader.get(3)),
            seq=reader.get(7),
            plan_hash=reader.get(6),
            battery=_from_level(reader.get(6), 1.0 / 62.0, 6),
            fix=FixType(reader.get(3)),
            gps_ok=reader.flag(),
            heading_ok=reader.flag(),
            actuators_ok=reader.flag(),
            prearm_ok=reader.flag(),
        )
    except (ValueError, IndexError):
        raise BitsError("no such state") from None


# ---- difference to a key --------------------------------------------------------------------------------------------


def _metres(key: RadioState, state: RadioState) -> tuple[float, float] | None:
    """North and east from the key's position, on a plane that both ends share."""
    if key.lat_rad is None or key.lon_rad is None or state.lat_rad is None or state.lon_rad is None:
        return None
    north = math.degrees(state.lat_rad - key.lat_rad) * _EARTH_M
    east = math.degrees(state.lon_rad - key.lon_rad) * _EARTH_M * math.cos(key.lat_rad)
    return north, east


def _moved(key: RadioState, north_m: float, east_m: float) -> tuple[float, float]:
    assert key.lat_rad is not None
    assert key.lon_rad is not None
    lat_rad = key.lat_rad + math.radians(north_m / _EARTH_M)
    return lat_rad, key.lon_rad + math.radians(east_m / (_EARTH_M * math.cos(key.lat_rad)))


def encode_delta(key: RadioState, key_mark: int, state: RadioState) -> bytes | None:
    """Four bytes against ``key`` as the shore has it (settled); None when the change does not fit or is one of status.

    2 bits mark of the key, 9 + 9 bits north and east in metres, 6 bits heading, 4 bits speed in 0.25 m/s, 2 bits depth step.
    """
    offset = _metres(key, state)
    if offset is None or state.status != key.status or state.sog_mps is None:
        return None
    north, east = round(offset[0]) + 256, round(offset[1]) + 256
    depth = _depth(state.alt_m) - _depth(key.alt_m)
    speed = round(state.sog_mps / _DELTA_SPEED_STEP)
    known = (state.alt_m is None) == (key.alt_m is None)
    if not (0 <= north < 512 and 0 <= east < 512 and 0 <= speed < 16 and known):
        return None
    writer = BitWriter()
    writer.put(key_mark & 3, 2)
    writer.put(north, 9)
    writer.put(east, 9)
    writer.put(_turn(state.psi_rad, 6), 6)
    writer.put(speed, 4)
    # shoaling must never be hidden by a narrow field: beyond a step either way a key is due
    if not -1 <= depth <= 2:
        return None
    writer.put(depth + 1, 2)
    return writer.bytes()


def mark_of(body: bytes) -> int:
    """Which key this is, or this difference belongs to."""
    return body[0] >> 6 if body else -1


def decode_delta(key: RadioState, body: bytes) -> RadioState:
    """Raises BitsError."""
    if len(body) != DELTA_BYTES or key.lat_rad is None:
        raise BitsError("no key for this difference")
    reader = BitReader(body)
    reader.get(2)
    lat_rad, lon_rad = _moved(key, reader.get(9) - 256.0, reader.get(9) - 256.0)
    psi_rad = _from_turn(reader.get(6), 6)
    speed = reader.get(4) * _DELTA_SPEED_STEP
    alt_m = None if key.alt_m is None else _from_depth(min(max(_depth(key.alt_m) + reader.get(2) - 1, 0), 126))
    return replace(key, lat_rad=lat_rad, lon_rad=lon_rad, psi_rad=psi_rad, sog_mps=speed, alt_m=alt_m)


# ---- batch ----------------------------------------------------------------------------------------------------------


def encode_batch(samples: Sequence[RadioState], step_s: int) -> bytes:
    """Up to 14 samples, ``step_s`` (1...1023 s) apart, the status being that of the last; at most 56 bytes.

    A sample without a position repeats the one before it, with the speed 'unknown'.
    """
    if not 0 < len(samples) <= BATCH_SAMPLES:
        raise ValueError("a batch holds 1 to 14 samples")
    first, last = samples[0], samples[-1]
    writer = BitWriter()
    writer.put(first.t_s % CLOCK_S, 12)
    writer.put(min(max(step_s, 1), 1023), 10)
    writer.put(len(samples) - 1, 4)
    _write_position(writer, first)
    _write_status(writer, last)
    scale = _batch_scale(samples)
    writer.put(scale, 3)
    place = replace(first, lat_rad=_from_grid(*_grid(first))[0], lon_rad=_from_grid(*_grid(first))[1])
    for sample in samples[1:]:
        place = _write_sample(writer, place, sample, _SCALES_M[scale])
    return writer.bytes()


def _batch_scale(samples: Sequence[RadioState]) -> int:
    far = 0.0
    for one, two in pairwise(samples):
        offset = _metres(one, two) or (0.0, 0.0)
        far = max(far, abs(offset[0]), abs(offset[1]))
    return next((index for index, scale in enumerate(_SCALES_M) if far < 60.0 * scale), len(_SCALES_M) - 1)


def _write_sample(writer: BitWriter, place: RadioState, sample: RadioState, scale_m: float) -> RadioState:
    """7 + 7 bits of movement since the last sample as rebuilt, 5 bits speed in 0.25 m/s, 4 bits heading: 23 bits."""
    offset = _metres(place, sample)
    north, east = (0, 0) if offset is None else (_step(offset[0], scale_m), _step(offset[1], scale_m))
    writer.put(north + 64, 7)
    writer.put(east + 64, 7)
    writer.put(_level(None if offset is None else sample.sog_mps, _DELTA_SPEED_STEP, 5), 5)
    writer.put(_turn(sample.psi_rad, 4), 4)
    return _after(place, north, east, scale_m)


def _step(length_m: float, scale_m: float) -> int:
    return min(max(round(length_m / scale_m), -63), 63)


def _after(place: RadioState, north: int, east: int, scale_m: float) -> RadioState:
    if place.lat_rad is None:
        return place
    lat_rad, lon_rad = _moved(place, north * scale_m, east * scale_m)
    return replace(place, lat_rad=lat_rad, lon_rad=lon_rad)


def decode_batch(body: bytes) -> tuple[list[RadioState], int]:
    """Return the samples, oldest first, and their spacing in s. Raises BitsError."""
    reader = BitReader(body)
    t_s, step_s, count = reader.get(12), reader.get(10), reader.get(4) + 1
    if count > BATCH_SAMPLES or step_s == 0:
        raise BitsError("no such batch")
    place = _read_status(reader, _read_position(reader, RadioState(t_s=t_s)))
    scale_m = _SCALES_M[reader.get(3)]
    samples = [place]
    for index in range(1, count):
        place = _after(place, reader.get(7) - 64, reader.get(7) - 64, scale_m)
        speed, turn = reader.get(5), reader.get(4)
        place = replace(
            place,
            t_s=(t_s + index * step_s) % CLOCK_S,
            sog_mps=_from_level(speed, _DELTA_SPEED_STEP, 5),
            psi_rad=_from_turn(turn, 4),
        )
        samples.append(place)
    return samples, step_s
