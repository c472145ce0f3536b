"""IMC packets: as the real programs sent them, in both byte orders, whole and in pieces, and what strangers may send."""

from __future__ import annotations

import hashlib
import random
import struct

import pytest

from mavlink_bridge import imc
from mavlink_bridge.crc import arc
from tests.imc_messages import captured

CAPTURED = captured()
HEADER = imc.Header(source=0x4001, destination=0x2801, utc_s=1_700_000_000.25)


def read(data: bytes, *, datagrams: bool = True) -> tuple[list[imc.Packet], imc.PacketCounters]:
    reader = imc.PacketReader(datagrams=datagrams)
    return reader.receive(data, 0), reader.counters


def sealed(number: int, payload: bytes) -> bytes:
    """A packet with a good checksum around any payload."""
    head = struct.pack("<HHHdHBHB", 0xFE54, number, len(payload), 0.0, 0x4001, 0, 0x2801, 0xFF)
    return head + payload + arc(head + payload).to_bytes(2, "little")


@pytest.mark.parametrize("name", CAPTURED)
def test_a_captured_packet_is_read_and_written_back_byte_for_byte(name):
    raw = CAPTURED[name]
    packet = imc.decode(raw)
    assert type(packet.message) is not imc.UnknownMessage
    assert imc.encode(packet) == raw


def test_what_the_captured_packets_say():
    announce = imc.decode(CAPTURED["Announce, DUNE"])
    assert (announce.header.source, announce.header.destination) == (0x0803, 0)
    assert announce.message.sys_name == "otter"
    assert announce.message.services.startswith("dune://0.0.0.0/uid/")
    plan = imc.decode(CAPTURED["PlanDB type=0 op=0, Neptus"]).message.arg
    kinds = [type(node.data) for node in plan.maneuvers]
    assert kinds == [imc.Goto, imc.Loiter, imc.Loiter, imc.StationKeeping, imc.Rows, imc.FollowPath]
    assert [len(node.data.points) for node in plan.maneuvers[5:]] == [3]
    eight = plan.maneuvers[2].data
    assert (eight.type, eight.direction) == (imc.LoiterType.EIGHT, imc.Direction.CCLOCKW)
    assert (eight.radius_m, eight.length_m, eight.bearing_rad, eight.duration_s) == (12.0, 50.0, 0.3, 25)


def test_the_md5_of_a_plan_is_the_one_that_the_vehicle_told_the_console():
    """The plan of one captured packet, its sum in another: both sides reckon over the little-endian fields alone."""
    plan = imc.decode(CAPTURED["PlanSpecification, DUNE"]).message
    data = imc.fields_bytes(plan)
    assert data == CAPTURED["PlanSpecification, DUNE"][20:-2]
    assert imc.parse_fields(imc.PlanSpecification, data) == plan
    told = imc.decode(CAPTURED["PlanDB type=1 op=5, DUNE"]).message.arg
    assert told.md5 == hashlib.md5(b"").digest()  # no plans: the sum of nothing


@pytest.mark.parametrize("name", CAPTURED)
def test_the_other_byte_order_says_the_same(name):
    packet = imc.decode(CAPTURED[name])
    swapped = imc.encode(imc.Packet(packet.header, packet.message, big_endian=True))
    assert swapped[:2] == bytes.fromhex("fe54")
    again = imc.decode(swapped)
    assert again.message == packet.message
    assert imc.encode(imc.Packet(again.header, again.message)) == CAPTURED[name]


@pytest.mark.parametrize("seed", range(5))
def test_a_stream_in_any_pieces_gives_the_same_packets(seed):
    stream = b"".join(CAPTURED.values())
    whole = [imc.decode(raw) for raw in CAPTURED.values()]
    chance = random.Random(seed)
    reader, found, at = imc.PacketReader(), [], 0
    while at < len(stream):
        size = chance.choice((1, 2, 7, 60, 700))
        found += reader.receive(stream[at : at + size], at)
        at += size
    assert found == whole
    assert reader.counters.skipped_bytes == 0


def test_both_of_two_packets_in_one_datagram_are_read():
    found, _ = read(CAPTURED["Heartbeat, Neptus"] + CAPTURED["Abort, Neptus"])
    assert [type(packet.message) for packet in found] == [imc.Heartbeat, imc.Abort]


def test_a_bad_checksum_costs_its_own_packet_only():
    bad = bytearray(CAPTURED["Abort, Neptus"])
    bad[9] ^= 1
    found, counters = read(bytes(bad) + b"noise" + CAPTURED["Heartbeat, Neptus"])
    assert [type(packet.message) for packet in found] == [imc.Heartbeat]
    assert counters.bad_crc == 1
    assert counters.skipped_bytes == len(bad) + 5


def test_a_head_whose_rest_never_comes_is_given_up():
    reader = imc.PacketReader()
    head = struct.pack("<HHHdHBHB", 0xFE54, 150, 60_000, 0.0, 1, 0, 2, 0)
    assert reader.receive(head + CAPTURED["Abort, Neptus"], 0) == []
    assert reader.receive(b"", 4_000_000) == []
    found = reader.receive(b"", 6_000_000)
    assert [type(packet.message) for packet in found] == [imc.Abort]
    assert reader.counters.stalled == 1


def test_a_message_that_the_table_does_not_have_is_told_and_kept():
    raw = sealed(4711, b"abc")
    packet = imc.decode(raw)
    assert packet.message == imc.UnknownMessage(4711, b"abc")
    assert imc.encode(packet) == raw


def test_a_plan_with_an_unknown_manoeuvre_still_says_whose_request_it_is():
    inner = struct.pack("<H", 473) + b"whatever"
    node = struct.pack("<H", 552) + b"\x02\x00M1" + inner
    plan = struct.pack("<H", 551) + b"\x01\x00p" + bytes(4) + bytes(2) + b"\x02\x00M1" + struct.pack("<H", 1) + node
    found, _ = read(sealed(556, struct.pack("<BBH", 0, 0, 77) + b"\x01\x00p" + plan))
    request = found[0].message
    assert (request.request_id, request.plan_id) == (77, "p")
    assert request.arg.maneuvers[0].maneuver_id == "M1"
    strange = imc.holds_unknown(request)
    assert imc.name_of(strange.number) == "CoverArea"
    with pytest.raises(ValueError, match="473"):
        imc.fields_bytes(request.arg)


@pytest.mark.parametrize(
    "payload",
    [b"", b"\x00\x00\x00\x00\x05\x00ab", struct.pack("<BBHHH", 0, 0, 1, 0, 0xFFFF) + b"\x00\x00more"],
    ids=["nothing", "a text too short", "bytes too many"],
)
def test_fields_that_do_not_fit_are_counted(payload):
    found, counters = read(sealed(556, payload) + CAPTURED["Abort, Neptus"])
    assert len(found) == 1
    assert counters.malformed == 1


def test_a_list_that_holds_something_else_than_it_may_is_malformed():
    """An Abort among the parameters: whoever reads the list would trip over it."""
    found, counters = read(sealed(804, b"\x01\x00x" + struct.pack("<HH", 1, 550)))
    assert found == []
    assert counters.malformed == 1
    found, counters = read(sealed(804, b"\x01\x00x" + struct.pack("<HH", 1, 4711)))
    assert counters.malformed == 1


def test_messages_inside_messages_end_somewhere():
    """A packet of control requests, each the argument of the one before, would otherwise exhaust the stack."""
    inner = struct.pack("<HBBHHH", 559, 0, 0, 0, 0, 0)
    found, counters = read(sealed(559, inner[2:] + inner * 5000))
    assert found == []
    assert counters.malformed == 1


def test_false_heads_cost_no_more_than_honest_bytes():
    """64 kB of nothing but sync numbers, each of which promises as much again, must not be summed 32 000 times."""
    reader = imc.PacketReader()
    noise = bytes.fromhex("54fe") * 32_000
    for number in range(20):
        reader.receive(noise, number)
    assert reader.pending <= 0xFFFF + 22
    rest = reader.receive(bytes(70_000), 30) + reader.receive(CAPTURED["Abort, Neptus"] * 2, 40)
    assert imc.Abort() in [packet.message for packet in rest]


def test_text_that_is_no_utf_8_is_kept():
    raw = sealed(160, b"\x01\x00x\x02\x00\xff\xc3")
    assert imc.encode(imc.decode(raw)) == raw


def test_what_does_not_fit_its_field_is_refused():
    with pytest.raises(ValueError, match="Voltage"):
        imc.encode(imc.Packet(HEADER, imc.Voltage(1e300)))
    with pytest.raises(ValueError, match="EntityState"):
        imc.encode(imc.Packet(HEADER, imc.EntityState(state=256)))
    with pytest.raises(ValueError, match="more than a packet"):
        imc.encode(imc.Packet(HEADER, imc.LogBookControl(msg=(imc.LogBookEntry(text="x" * 60_000),) * 2)))
    with pytest.raises(ValueError, match="TextMessage"):
        imc.encode(imc.Packet(HEADER, imc.TextMessage(text="x" * 70_000)))
