"""Up to 14 states in one packet, for a channel on which each packet is dear: each sample but the first as a step from the last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

from .bits import BitReader, BitsError, BitWriter
from .state_fields import (
    CLOCK_S,
    COARSE_SPEED_STEP,
    RadioState,
    from_grid,
    from_level,
    from_turn,
    metres_between,
    moved,
    read_position,
    read_status,
    to_grid,
    to_level,
    to_turn,
    write_position,
    write_status,
)

BATCH_SAMPLES: Final = 14
FIRST_BITS: Final = 140
SAMPLE_BITS: Final = 23
"""A batch: what its first sample and the status take, and each other sample."""
_SCALES_M: Final = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


def encode_batch(samples: Sequence[RadioState], step_s: int) -> bytes:
    """Up to 14 samples, ``step_s`` (1...1023 s) apart, the status being that of the last; at most 55 bytes, whose number tells that of
    the samples.

    A sample without a position repeats the one before it, with the speed 'unknown'.
    """
    if not 0 < len(samples) <= BATCH_SAMPLES:
        raise ValueError("a batch holds 1 to 14 samples")
    first, last = samples[0], samples[-1]
    writer = BitWriter()
    writer.put(first.t_s % CLOCK_S, 12)
    writer.put(min(max(step_s, 1), 1023), 10)
    write_position(writer, first)
    write_status(writer, last)
    scale = _batch_scale(samples)
    writer.put(scale, 3)
    place = replace(first, lat_rad=from_grid(*to_grid(first))[0], lon_rad=from_grid(*to_grid(first))[1])
    for sample in samples[1:]:
        place = _write_sample(writer, place, sample, _SCALES_M[scale])
    return writer.bytes()


def _batch_scale(samples: Sequence[RadioState]) -> int:
    far = 0.0
    for one, two in pairwise(samples):
        offset = metres_between(one, two) or (0.0, 0.0)
        far = max(far, abs(offset[0]), abs(offset[1]))
    return next((index for index, scale in enumerate(_SCALES_M) if far < 60.0 * scale), len(_SCALES_M) - 1)


def _write_sample(writer: BitWriter, place: RadioState, sample: RadioState, scale_m: float) -> RadioState:
    """7 + 7 bits of movement since the last sample as rebuilt, 5 bits speed in 0.25 m/s, 4 bits heading: 23 bits."""
    offset = metres_between(place, sample)
    north, east = (0, 0) if offset is None else (_step(offset[0], scale_m), _step(offset[1], scale_m))
    writer.put(north + 64, 7)
    writer.put(east + 64, 7)
    writer.put(to_level(None if offset is None else sample.sog_mps, COARSE_SPEED_STEP, 5), 5)
    writer.put(to_turn(sample.psi_rad, 4), 4)
    return _after(place, north, east, scale_m)


def _step(length_m: float, scale_m: float) -> int:
    return min(max(round(length_m / scale_m), -63), 63)


def _after(place: RadioState, north: int, east: int, scale_m: float) -> RadioState:
    if place.lat_rad is None:
        return place
    lat_rad, lon_rad = moved(place, north * scale_m, east * scale_m)
    return replace(place, lat_rad=lat_rad, lon_rad=lon_rad)


def decode_batch(body: bytes) -> tuple[list[RadioState], int]:
    """Return the samples, oldest first, and their spacing in s. Raises BitsError."""
    reader = BitReader(body)
    count = (len(body) * 8 - FIRST_BITS) // SAMPLE_BITS + 1
    t_s, step_s = reader.get(12), reader.get(10)
    if not 0 < count <= BATCH_SAMPLES or step_s == 0:
        raise BitsError("no such batch")
    place = read_status(reader, read_position(reader, RadioState(t_s=t_s)))
    scale_m = _SCALES_M[reader.get(3)]
    samples = [place]
    for index in range(1, count):
        place = _after(place, reader.get(7) - 64, reader.get(7) - 64, scale_m)
        speed, turn = reader.get(5), reader.get(4)
        place = replace(
            place,
            t_s=(t_s + index * step_s) % CLOCK_S,
            sog_mps=from_level(speed, COARSE_SPEED_STEP, 5),
            psi_rad=from_turn(turn, 4),
        )
        samples.append(place)
    return samples, step_s
