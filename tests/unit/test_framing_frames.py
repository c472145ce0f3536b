"""Frames cut out of bytes: both versions, hostile heads, unknown ids, time limits, copies."""

from __future__ import annotations

import pytest
from pymavlink.dialects.v20 import all as library

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer, DuplicateFilter
from mavlink_bridge.mavlink.wire.signing import Signer, SigningState

HEARTBEAT = dialect.MAVLink_heartbeat_message(11, 3, 81, 0, 4, 3)


def beats(count: int) -> list[bytes]:
    codec = Codec(1, 1)
    return [codec.encode(HEARTBEAT) for _ in range(count)]


def test_heartbeat_of_the_library_is_cut_and_read():
    # heartbeat packed by pymavlink, not by our codec
    mav = library.MAVLink(None, 7, 3)
    mav.seq = 42
    raw = library.MAVLink_heartbeat_message(11, 0, 81, 65_536, 4, 3).pack(mav)
    (frame,) = Deframer().receive(raw, 0)
    assert (frame.system, frame.component, frame.sequence, frame.version) == (7, 3, 42, 2)
    assert decode(frame).custom_mode == 65_536


def test_mavlink_1_frames_are_read_beside_mavlink_2():
    mav = library.MAVLink(None, 255, 190)
    old = library.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(mav, force_mavlink1=True)
    frames = Deframer().receive(old + beats(1)[0] + old, 0)
    assert [frame.version for frame in frames] == [1, 2, 1]
    assert decode(frames[0]).type == 6


def test_a_false_head_that_claims_255_bytes_swallows_nothing():
    # FD FF 00 in front made pymavlink lose twelve heartbeats
    deframer = Deframer()
    stream = b"\xfd\xff\x00" + b"".join(beats(14))
    frames = deframer.receive(stream, 0)
    frames += deframer.receive(b"", 600_000)
    assert len(frames) == 14


def test_bad_frame_between_good_ones_costs_only_itself():
    good = beats(3)
    bad = bytearray(good[1])
    bad[12] ^= 0xFF
    deframer = Deframer()
    frames = deframer.receive(good[0] + bytes(bad) + good[2], 0)
    assert [frame.sequence for frame in frames] == [0, 2]
    assert deframer.counters.bad_crc == 1


def test_truncated_at_every_length_the_next_frame_is_found():
    first, second = beats(2)
    for length in range(len(first)):
        deframer = Deframer()
        frames = deframer.receive(first[:length] + second, 0)
        frames += deframer.receive(b"", 10_000_000)
        assert [frame.sequence for frame in frames] == [1], f"cut after {length} bytes"


@pytest.mark.parametrize("length", [0, 1, 8, 9, 50, 254, 255])
def test_wrong_length_byte_never_hides_what_follows(length):
    first, second = beats(2)
    damaged = first[:1] + bytes((length,)) + first[2:]
    deframer = Deframer()
    frames = deframer.receive(damaged + second, 0)
    frames += deframer.receive(b"", 10_000_000)
    assert 1 in [frame.sequence for frame in frames]


def test_unknown_id_is_counted_and_dropped_or_passed_when_asked_for():
    # id 8388607 is in no dialect; the checksum cannot be known
    unknown = b"\xfd\x04\x00\x00\x05\x01\x01\xff\xff\x7f" + b"abcd" + b"\x12\x34"
    dropping, passing = Deframer(), Deframer(pass_unknown=True)
    stream = unknown + beats(1)[0]
    assert [frame.message_id for frame in dropping.receive(stream, 0)] == [0]
    assert dropping.counters.unknown == 1
    frames = passing.receive(stream, 0)
    assert [(frame.message_id, frame.known) for frame in frames] == [(8_388_607, False), (0, True)]
    assert frames[0].raw == unknown


def test_unknown_incompatibility_flags_are_refused():
    raw = bytearray(beats(1)[0])
    raw[2] = 0x02
    deframer = Deframer()
    assert deframer.receive(bytes(raw), 0) == []
    assert deframer.counters.bad_flags == 1


def test_signed_frames_carry_link_and_time_stamp():
    codec = Codec(1, 1, signer=Signer(SigningState(bytes(32), timestamp=10**12), link_id=5))
    (frame,) = Deframer().receive(codec.encode(HEARTBEAT), 0)
    assert (frame.signed, frame.link_id, frame.timestamp) == (True, 5, 10**12 + 1)


def test_stalled_head_is_given_up_after_its_time_and_not_before():
    first, second = beats(2)
    deframer = Deframer(stall_us=500_000)
    assert deframer.receive(first[:15], 0) == []
    assert deframer.receive(b"", 400_000) == []
    assert deframer.receive(first[15:], 450_000)[0].sequence == 0
    assert deframer.receive(first[:15], 1_000_000) == []
    assert deframer.receive(b"", 1_600_000) == []
    assert deframer.pending == 0
    assert deframer.receive(second, 1_700_000)[0].sequence == 1


@pytest.mark.parametrize("noise", [b"\xfe" * 20, b"\xfd" * 20, b"\xfd\xff\x00" * 7, bytes(range(0xE0, 0x100)) * 2])
@pytest.mark.parametrize("pieces", [1, 3, 40])
def test_noise_holds_up_what_follows_for_one_time_limit_however_many_heads_it_has(noise, pieces):
    held_up, later = beats(2)
    stream = noise + held_up
    size = -(-len(stream) // pieces)
    for deframer in (Deframer(stall_us=500_000), Deframer(stall_us=500_000, pass_unknown=True)):
        frames = []
        for number in range(pieces):
            frames += deframer.receive(stream[number * size : (number + 1) * size], number * 1_000)
        frames += deframer.receive(later, 545_000)
        assert [frame.sequence for frame in frames if frame.known] == [0, 1]


def test_a_frame_that_has_begun_behind_an_old_false_head_is_not_given_up_with_it():
    (frame,) = beats(1)
    deframer = Deframer(stall_us=500_000)
    assert deframer.receive(b"\xfe" * 20, 0) == []
    assert deframer.receive(frame[:9], 450_000) == []
    assert deframer.receive(b"", 600_000) == []
    assert deframer.pending == 9
    assert len(deframer.receive(frame[9:], 700_000)) == 1


def test_datagrams_do_not_wait_for_each_other():
    first, second = beats(2)
    deframer = Deframer(datagrams=True)
    assert deframer.receive(first[:15], 0) == []
    assert [frame.sequence for frame in deframer.receive(second, 0)] == [1]


def test_empty_and_huge_datagrams_and_noise_keep_the_buffer_small():
    deframer = Deframer()
    assert deframer.receive(b"", 0) == []
    for filler in (b"\xfd", b"\xfe", b"\x00", b"\xfd\xff\x00\x00\x00\x01\x01\x00\x00\x00"):
        deframer.receive(filler * (65_507 // len(filler)), 0)
        assert deframer.pending < 280


def test_a_copy_is_found_and_a_repeat_with_a_new_number_is_not():
    (first, second) = (Deframer().receive(raw, 0)[0] for raw in beats(2))
    seen = DuplicateFilter(window_us=1_000_000, size=4)
    assert seen.is_new(first, 0)
    assert not seen.is_new(first, 900_000)
    assert seen.is_new(second, 900_000)
    assert seen.is_new(first, 3_000_000)
    assert seen.duplicates == 1


def test_a_sender_that_does_not_count_its_frames_is_heard_once_in_a_window():
    (frame,) = Deframer().receive(beats(1)[0], 0)
    seen = DuplicateFilter(window_us=1_000_000)
    heard = [now_us for now_us in range(0, 10_000_000, 200_000) if seen.is_new(frame, now_us)]
    assert heard == list(range(0, 10_000_000, 1_200_000))
