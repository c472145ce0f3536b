"""Messages to bytes and back, compared with pymavlink's own packing for every message it has."""

from __future__ import annotations

import math
import random
import struct

import pytest
from pymavlink.dialects.v20 import all as library

from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect, payload
from mavlink_bridge.mavlink.wire.extensions import crc_extra
from mavlink_bridge.mavlink.wire.framing import Deframer

LONGER_HERE = {
    message_id
    for message_id, message in dialect.mavlink_map.items()
    if message_id not in library.mavlink_map or message.fieldnames != library.mavlink_map[message_id].fieldnames
}


def sample(message_class, rng):
    values = []
    for name, kind in zip(message_class.fieldnames, message_class.fieldtypes, strict=True):
        length = message_class.array_lengths[message_class.ordered_fieldnames.index(name)]
        if kind == "char":
            values.append(b"text"[: max(1, length)] if length else b"t")
        elif kind in ("float", "double"):
            values.append([rng.randrange(64) / 4 for _ in range(length)] if length else rng.randrange(64) / 4)
        else:
            values.append([rng.randrange(100) for _ in range(length)] if length else rng.randrange(100))
    return message_class(*values)


def test_every_message_is_packed_as_the_library_packs_it_and_read_back():
    rng = random.Random(1)
    codec, deframer, mav = Codec(9, 8), Deframer(), library.MAVLink(None, 9, 8)
    for message_id, message_class in dialect.mavlink_map.items():
        message = sample(message_class, rng)
        mav.seq = codec._sequence
        raw = codec.encode(message)
        if message_id not in LONGER_HERE:
            assert raw == message.pack(mav), message_class.msgname
        (frame,) = deframer.receive(raw, 0)
        back = decode(frame)
        for name in message_class.fieldnames:
            assert getattr(back, name) == getattr(message, name), f"{message_class.msgname}.{name}"


def test_the_missing_messages_and_fields_are_there():
    assert {"MISSION_COUNT", "MISSION_ACK", "MISSION_CURRENT"} <= {
        dialect.mavlink_map[message_id].msgname for message_id in LONGER_HERE
    }
    ack = dialect.MAVLink_mission_ack_message(255, 190, 0, 0, opaque_id=0xDEADBEEF)
    assert payload(ack) == bytes((255, 190, 0, 0)) + struct.pack("<I", 0xDEADBEEF)
    current = dialect.MAVLink_mission_current_message(3, 9, 3, 0, mission_id=1, fence_id=2, rally_points_id=3)
    (frame,) = Deframer().receive(Codec(1, 1).encode(current), 0)
    back = decode(frame)
    assert (back.total, back.mission_id, back.fence_id, back.rally_points_id) == (9, 1, 2, 3)


@pytest.mark.parametrize(("name", "expected"), [("COMPONENT_METADATA", 182), ("FIGURE_EIGHT_EXECUTION_STATUS", 93)])
def test_crc_extra_of_messages_that_the_library_lacks(name, expected):
    # figures of MAVLink's generated C headers
    assert dialect.mavlink_map[getattr(dialect, f"MAVLINK_MSG_ID_{name}")].crc_extra == expected


def test_crc_extra_is_computed_as_the_generator_does_for_every_message_of_the_library():
    for message in library.mavlink_map.values():
        ordered = [
            (message.fieldtypes[message.fieldnames.index(name)], name, length)
            for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True)
        ]
        # extension fields do not count, and the library does not say where they begin
        assert any(
            crc_extra(message.msgname, ordered[:count]) == message.crc_extra for count in range(1, len(ordered) + 1)
        ), message.msgname


def test_an_older_peer_reads_an_extended_message():
    raw = Codec(1, 1).encode(dialect.MAVLink_mission_ack_message(255, 190, 5, 1, opaque_id=77))
    old = library.MAVLink(None).parse_buffer(raw)
    assert (old[0].type, old[0].mission_type) == (5, 1)


def test_nan_and_infinity_pass_through():
    item = dialect.MAVLink_mission_item_int_message(
        1, 1, 0, 3, 16, 0, 1, math.nan, math.inf, -math.inf, -0.0, 2**31 - 1, -(2**31), math.nan, 0
    )
    (frame,) = Deframer().receive(Codec(255, 190).encode(item), 0)
    back = decode(frame)
    assert math.isnan(back.param1)
    assert (back.param2, back.param3) == (math.inf, -math.inf)
    assert math.copysign(1.0, back.param4) == -1.0
    assert (back.x, back.y) == (2**31 - 1, -(2**31))


def test_sequence_numbers_count_per_codec_and_wrap():
    codec, other = Codec(1, 1), Codec(1, 1)
    message = dialect.MAVLink_heartbeat_message(11, 3, 81, 0, 4, 3)
    numbers = [codec.encode(message)[4] for _ in range(258)]
    assert numbers == [*range(256), 0, 1]
    assert other.encode(message)[4] == 0


def test_a_payload_can_be_shared_between_links():
    message = dialect.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    body = payload(message)
    assert Codec(1, 1).seal(message.get_msgId(), body) == Codec(1, 1).encode(message)
