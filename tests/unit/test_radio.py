"""The simulated radio: what goes in comes out, late, in pieces, not while the other one talks, and counted."""

import random

import pytest

from mavlink_bridge.radio.air.airtime import PHYS, packet_us
from sitl.radio.air import RadioConfig, RadioPair

MS = 1000


def run(pair, until_us, step_us=5 * MS, from_us=None):
    """Step to a time; return what each host read."""
    vessel = shore = b""
    now = pair.air.now_us if from_us is None else from_us
    while now < until_us:
        now += step_us
        pair.step(now)
        vessel += pair.vessel.read()
        shore += pair.shore.read()
    return vessel, shore


def test_bytes_arrive_after_serial_air_and_module_time():
    pair = RadioPair(RadioConfig(delay_ms=20, gap_ms=5))
    pair.step(0)
    pair.vessel.write(b"x" * 24)
    air_us = packet_us(24, PHYS["A"])
    arrival_us = 24 * 1041 + 5 * MS + air_us + 20 * MS + 24 * 1041
    assert run(pair, arrival_us - 5 * MS, MS)[1] != b"x" * 24
    pair.step(arrival_us)
    pair.step(arrival_us + 2 * MS)
    assert [(item.origin, len(item.data), item.fate) for item in pair.air.log] == [("vessel", 24, "received")]
    assert pair.air.log[0].end_us - pair.air.log[0].start_us == air_us


def test_both_directions_in_turn_carry_everything():
    pair = RadioPair(RadioConfig(split=True), random.Random(1))
    text = bytes(range(256))
    pair.vessel.write(text)
    assert run(pair, 6_000 * MS)[1] == text
    pair.shore.write(text)
    assert run(pair, 12_000 * MS)[0] == text
    assert max(len(item.data) for item in pair.air.log) == 62


def test_writes_close_together_travel_as_one_packet_and_apart_as_two():
    pair = RadioPair(RadioConfig(gap_ms=5))
    pair.step(0)
    pair.vessel.write(b"one")
    pair.step(4 * MS)
    pair.vessel.write(b"two")
    run(pair, 2_000 * MS)
    pair.vessel.write(b"one")
    run(pair, 2_050 * MS)
    pair.vessel.write(b"two")
    run(pair, 4_000 * MS)
    assert [item.data for item in pair.air.log] == [b"onetwo", b"one", b"two"]


def test_who_talks_at_once_is_not_heard():
    pair = RadioPair()
    pair.vessel.write(b"a" * 20)
    pair.step(100 * MS)
    pair.shore.write(b"b" * 20)
    assert run(pair, 3_000 * MS) == (b"", b"")
    assert {item.fate for item in pair.air.log} == {"collision"}


def test_a_listening_module_waits():
    pair = RadioPair(RadioConfig(listen_first=True))
    pair.vessel.write(b"a" * 20)
    pair.step(100 * MS)
    pair.shore.write(b"b" * 20)
    assert run(pair, 3_000 * MS) == (b"b" * 20, b"a" * 20)


@pytest.mark.parametrize("burst_s", [0.0, 5.0])
def test_loss_is_as_asked(burst_s):
    pair = RadioPair(RadioConfig(loss=0.3, burst_s=burst_s), random.Random(2))
    count = 4000
    for index in range(count):
        pair.step(index * 1_000 * MS)
        pair.vessel.write(b"0123456789")
    pair.step((count + 1) * 1_000 * MS)
    lost = sum(item.fate == "faded" for item in pair.air.log) / count
    assert lost == pytest.approx(0.3, abs=0.05)
    runs = sum(one.fate != two.fate for one, two in zip(list(pair.air.log)[:-1], list(pair.air.log)[1:], strict=True))
    assert (runs < count * 0.15) == (burst_s > 0)


def test_the_same_seed_gives_the_same_air():
    def fates(seed):
        pair = RadioPair(RadioConfig(loss=0.4, corrupt=0.2), random.Random(seed))
        heard = b""
        for index in range(50):
            pair.vessel.write(bytes([index]) * 9)
            heard += run(pair, (index + 1) * 1_000 * MS, 50 * MS)[1]
        return heard

    assert fates(3) == fates(3)
    assert fates(3) != fates(4)


def test_the_account_adds_up():
    pair = RadioPair()
    for index in range(10):
        pair.step(index * 2_000 * MS)
        pair.vessel.write(b"x" * 12)
    pair.step(30_000 * MS)
    assert pair.air.airtime_us("vessel") == 10 * packet_us(12, PHYS["A"])
    assert sum(pair.air.per_second_us("vessel").values()) == pair.air.airtime_us("vessel")
    assert max(pair.air.per_second_us("vessel").values()) <= 1_000_000
    assert pair.air.worst_hour_us("vessel") == pair.air.airtime_us("vessel")
    assert pair.air.airtime_us("shore") == 0
    assert pair.air.bytes_sent("vessel") == 120


def test_worst_hour_slides():
    pair = RadioPair()
    for minute in range(0, 180, 10):
        pair.step(minute * 60_000 * MS)
        pair.vessel.write(b"x" * 12)
    pair.step(11_000_000 * MS)
    assert pair.air.worst_hour_us("vessel") == 6 * packet_us(12, PHYS["A"])


def test_modules_with_other_settings_do_not_hear_each_other():
    pair = RadioPair()
    module = pair.shore.module
    module.block = bytes([21]) + module.block[1:]
    pair.vessel.write(b"hello")
    assert run(pair, 2_000 * MS)[1] == b""
    assert pair.air.log[0].fate == "unheard"


def test_configuration_mode_answers_and_keeps_off_the_air():
    pair = RadioPair()
    end = pair.vessel
    end.module.set_low = True
    pair.step(20 * MS)
    end.write(b"\xaa\xfa\xaa")
    answer = run(pair, 200 * MS)[0]
    assert answer == b"LORA6500PRO_VER3.1_E\r\n"
    end.write(b"\xaa\xfa\x01")
    block = run(pair, 400 * MS)[0]
    assert block[:-2] == end.module.block
    assert len(block) == 35
    new = bytes([21]) + block[1:-2]
    end.write(b"\xaa\xfa\x03" + new)
    assert run(pair, 600 * MS)[0] == b"OK\r\n"
    assert end.module.block[0] == 21
    end.write(b"\xaa\xfa\x02")
    assert run(pair, 800 * MS)[0] == b"OK\r\n"
    assert end.module.block[0] == 20
    assert not pair.air.log


def test_a_flood_overflows_and_is_counted():
    pair = RadioPair(RadioConfig(buffer_bytes=128))
    assert pair.vessel.write(b"x" * 200) == 200
    assert pair.vessel.module.overflow_bytes == 72
    assert len(run(pair, 5_000 * MS)[1]) == 128
