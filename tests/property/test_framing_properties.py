"""However a stream is cut or damaged, every intact frame comes out, in order."""

from __future__ import annotations

import random

from hypothesis import given, settings, strategies as st

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer, Frame
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState


def mixed_frames(count: int, seed: int) -> list[bytes]:
    rng = random.Random(seed)
    plain = Codec(1, 1)
    signed = Codec(2, 1, signer=Signer(SigningState(bytes(32)), 1))
    frames = []
    for number in range(count):
        message = rng.choice(
            [
                dialect.MAVLink_heartbeat_message(11, 3, 81, number, 4, 3),
                dialect.MAVLink_attitude_message(number, rng.random(), 0.1, -0.2, 0.0, 0.0, 0.0),
                dialect.MAVLink_statustext_message(6, b"\xfd\xfe\xfd text with markers", 0, 0),
                dialect.MAVLink_global_position_int_message(number, 411850123, -87062154, 0, 0, 1, 2, 3, 4),
                dialect.MAVLink_sys_status_message(1, 1, 1, 0, 12000, -1, 50, 0, 0, 0, 0, 0, 0),
            ]
        )
        frames.append((signed if rng.random() < 0.2 else plain).encode(message))
    return frames


def cut_all(deframer: Deframer, stream: bytes, sizes: list[int]) -> list[Frame]:
    found, at, turn = [], 0, 0
    while at < len(stream):
        size = max(1, sizes[turn % len(sizes)])
        found += deframer.receive(stream[at : at + size], 0)
        at, turn = at + size, turn + 1
    for step in range(1, 400):
        found += deframer.receive(b"", step * 1_000_000)
    return found


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.lists(st.integers(1, 60), min_size=1, max_size=6), st.binary(max_size=40))
def test_whole_byte_by_byte_and_random_chunks_agree(seed, sizes, noise):
    stream = noise + b"".join(mixed_frames(12, seed)) + noise
    whole = [frame.raw for frame in cut_all(Deframer(), stream, [len(stream)])]
    assert whole == [frame.raw for frame in cut_all(Deframer(), stream, [1])]
    assert whole == [frame.raw for frame in cut_all(Deframer(), stream, sizes)]
    assert [raw for raw in whole if raw in set(mixed_frames(12, seed))] == mixed_frames(12, seed)


def test_at_one_percent_lost_bytes_every_intact_frame_is_recovered():
    for seed in range(40):
        rng = random.Random(seed)
        frames = mixed_frames(200, seed)
        stream, intact = bytearray(), []
        for raw in frames:
            kept = bytes(byte for byte in raw if rng.random() >= 0.01)
            stream += kept
            if kept == raw:
                intact.append(raw)
        found = [frame.raw for frame in cut_all(Deframer(), bytes(stream), [64])]
        missing = [raw for raw in intact if raw not in found]
        assert not missing, f"seed {seed}: {len(missing)} of {len(intact)} intact frames lost"


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=400), st.integers(1, 50))
def test_noise_never_raises_and_is_accounted_for(noise, size):
    deframer = Deframer()
    frames = cut_all(deframer, noise, [size])
    assert sum(len(frame.raw) for frame in frames) + deframer.counters.skipped_bytes == len(noise)
    assert deframer.pending == 0


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(sorted(dialect.mavlink_map)), st.binary(max_size=255), st.booleans())
def test_any_payload_of_any_message_decodes_and_packs_again(message_id, payload, old):
    """Truncated, too long, NaN, texts that are no text: decoding never raises, and what it made can be encoded."""
    frame = Frame(b"\xfd" + bytes(12) + payload, 1 if old else 2, 0, 1, 1, message_id, payload)
    message = decode(frame)
    assert message.get_msgId() == message_id
    (back,) = Deframer().receive(Codec(1, 1).encode(message), 0)
    size = dialect.mavlink_map[message_id].unpacker.size
    sent = payload[:size].rstrip(b"\0")
    if not any(kind in ("float", "double") for kind in dialect.mavlink_map[message_id].fieldtypes):
        assert back.payload.rstrip(b"\0") == sent
