"""The parts of the compact link, each against its promise."""

import contextlib
import math
from dataclasses import replace

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language.messages import Action, FixType, GuardState, Mode, PlanState
from mavlink_bridge.radio.air.ledger import HOUR_US, Ledger, Priority
from mavlink_bridge.radio.codec import erasure
from mavlink_bridge.radio.codec.batch import decode_batch, encode_batch
from mavlink_bridge.radio.codec.bits import BitReader, BitsError, BitWriter, float_bits
from mavlink_bridge.radio.codec.json_stream import JsonStream
from mavlink_bridge.radio.codec.state import decode_delta, decode_key, encode_delta, encode_key, settle
from mavlink_bridge.radio.codec.state_fields import RadioState

angle = st.floats(-math.pi, math.pi - 1e-6)
states = st.builds(
    RadioState,
    t_s=st.integers(0, 4095),
    lat_rad=st.floats(math.radians(-85), math.radians(85)),
    lon_rad=st.floats(math.radians(-179.9), math.radians(179.9)),
    sog_mps=st.one_of(st.none(), st.floats(0, 12)),
    psi_rad=st.one_of(st.none(), angle),
    phi_rad=st.one_of(st.none(), st.floats(-0.4, 0.4)),
    theta_rad=st.one_of(st.none(), st.floats(-0.4, 0.4)),
    alt_m=st.one_of(st.none(), st.floats(0.2, 400)),
    mode=st.sampled_from(list(Mode)),
    armed=st.booleans(),
    action=st.sampled_from(list(Action)),
    guard=st.sampled_from(list(GuardState)),
    plan_state=st.sampled_from(list(PlanState)),
    seq=st.integers(0, 127),
    plan_hash=st.integers(0, 63),
    battery=st.one_of(st.none(), st.floats(0, 1)),
    fix=st.sampled_from(list(FixType)),
    gps_ok=st.booleans(),
    heading_ok=st.booleans(),
    actuators_ok=st.booleans(),
    prearm_ok=st.booleans(),
    satellites=st.one_of(st.none(), st.integers(0, 40)),
)


def metres(one, two):
    north = math.degrees(two.lat_rad - one.lat_rad) * 111_320.0
    return math.hypot(north, math.degrees(two.lon_rad - one.lon_rad) * 111_320.0 * math.cos(one.lat_rad))


@settings(max_examples=200, deadline=None)
@given(states)
def test_a_key_tells_the_state_within_its_steps(state):
    body = encode_key(state, 2)
    back = decode_key(body)
    assert len(body) == 16
    assert decode_key(encode_key(state, timed=True)).t_s == state.t_s
    assert back.status == state.status
    assert metres(state, back) < 0.35
    for name, step in (("sog_mps", 0.026), ("psi_rad", 0.013), ("phi_rad", 0.036), ("battery", 0.009)):
        was, now = getattr(state, name), getattr(back, name)
        assert (was is None) == (now is None)
        if was is not None:
            off = (now - was + math.pi) % math.tau - math.pi if name == "psi_rad" else now - was
            assert abs(off) <= step
    assert (state.alt_m is None) == (back.alt_m is None)
    assert state.alt_m is None or back.alt_m == pytest.approx(state.alt_m, rel=0.036)


@settings(max_examples=200, deadline=None)
@given(states, st.floats(-300, 300), st.floats(-300, 300), st.floats(0, 5))
def test_a_difference_is_right_or_not_made(key, north, east, sog):
    lat = key.lat_rad + math.radians(north / 111_320.0)
    lon = key.lon_rad + math.radians(east / 111_320.0 / math.cos(key.lat_rad))
    state = replace(key, lat_rad=lat, lon_rad=lon, sog_mps=sog)
    body = encode_delta(settle(key), 1, state)
    if body is None:
        return
    back = decode_delta(settle(key), body)
    assert len(body) == 4
    assert metres(state, back) < 0.8
    assert back.sog_mps == pytest.approx(sog, abs=0.13)


@settings(max_examples=100, deadline=None)
@given(states, st.integers(1, 14), st.floats(0, 3), angle, st.integers(1, 300))
def test_a_batch_follows_the_track(first, count, speed, course, step_s):
    track = []
    for index in range(count):
        north, east = index * step_s * speed * math.cos(course), index * step_s * speed * math.sin(course)
        lat = first.lat_rad + math.radians(north / 111_320.0)
        lon = first.lon_rad + math.radians(east / 111_320.0 / math.cos(first.lat_rad))
        track.append(replace(first, lat_rad=lat, lon_rad=lon, t_s=(first.t_s + index * step_s) % 4096))
    body = encode_batch(track, step_s)
    back, spacing = decode_batch(body)
    assert len(body) <= 55
    assert (len(back), spacing) == (count, step_s)
    allowed = max(1.0, step_s * speed / 60.0 * 1.5)
    assert all(metres(was, now) < allowed + metres(track[0], was) * 0.01 for was, now in zip(track, back, strict=True))
    assert back[-1].status == track[-1].status


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60))
def test_noise_gives_a_state_or_a_refusal(data):
    for decode in (
        decode_key,
        decode_batch,
        lambda body: decode_delta(settle(RadioState(lat_rad=0.7, lon_rad=0.1)), body),
    ):
        with contextlib.suppress(BitsError):
            assert decode(data)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.integers(-(10**6), 10**6), st.integers(0, 15))), st.lists(st.floats(width=32)))
def test_numbers_come_back(numbers, reals):
    writer = BitWriter()
    for value, k in numbers:
        writer.signed(value, k)
    for value in reals:
        writer.real(value)
    reader = BitReader(writer.bytes())
    assert [(reader.signed(k), k) for _, k in numbers] == numbers
    assert [float_bits(reader.real()) for _ in reals] == [float_bits(value) for value in reals]
    assert reader.left < 8


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 12), st.binary(min_size=1, max_size=20), st.data())
def test_any_rows_rebuild_the_whole(count, seed, data):
    parts = tuple(bytes((value * (index + 3) + index) & 0xFF for value in seed) for index in range(count))
    everything = [*range(count), *range(64, 64 + 2 * count)]
    chosen = data.draw(st.permutations(everything))[:count]
    rows = {number: erasure.piece(parts, number) for number in chosen}
    assert erasure.rebuild(rows, count) == b"".join(parts)
    rows.popitem()
    assert erasure.rebuild(rows, count) is None


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 2_000_000), st.sampled_from(list(Priority)), st.integers(0, 900_000_000))))
def test_no_hour_holds_more_than_its_limit(sends):
    ledger, now_us, sent = Ledger(3_600_000), 0, []
    for airtime_us, priority, pause_us in sends:
        now_us += pause_us
        if ledger.allows(airtime_us, priority, now_us):
            ledger.charge(airtime_us, now_us)
            sent.append((now_us, airtime_us, priority))
    for end_us, _, _ in sent:
        hour = [spent for at_us, spent, _ in sent if end_us - HOUR_US < at_us <= end_us]
        assert sum(hour) <= 3_600_000
    for end_us, _, priority in sent:
        if priority is not Priority.STOP:
            others = [spent for at_us, spent, _ in sent if end_us - HOUR_US < at_us <= end_us]
            assert sum(others) <= 3_600_000


def test_a_fifth_of_the_hour_waits_for_a_stop():
    ledger = Ledger(3_600_000)
    while ledger.allows(100_000, Priority.COMMAND, 0):
        ledger.charge(100_000, 0)
    assert ledger.used_us(0) == 2_800_000
    assert not ledger.allows(300_000, Priority.COMMAND, 0)
    assert ledger.allows(700_000, Priority.STOP, 0)
    assert ledger.wait_us(300_000, Priority.COMMAND, 0) == HOUR_US


def test_a_restart_forgets_no_airtime():
    ledger = Ledger(3_600_000)
    for minute in range(10):
        ledger.charge(200_000, minute * 60_000_000)
    now_us = 600_000_000
    again = Ledger(3_600_000)
    again.restore(ledger.save(now_us), 5)
    assert again.used_us(5) >= ledger.used_us(now_us)
    assert again.used_us(5 + HOUR_US) == 0


OBJECTS = [b'{"a":1}', b'{"ID":"x}y","b":[1,{"c":"\\""}]}', b'[{"a":1},{"b":2}]', b"{}"]


@settings(max_examples=80, deadline=None)
@given(
    st.lists(st.sampled_from(OBJECTS), max_size=6),
    st.sampled_from([b"", b"\n", b"\r\n", b" junk "]),
    st.integers(1, 30),
)
def test_objects_are_cut_out_of_any_stream(objects, between, size):
    data = between.join(objects) + between
    stream = JsonStream()
    found = [value for at in range(0, len(data), size) for value in stream.receive(data[at : at + size], 0)]
    assert found == objects


def test_a_broken_object_does_not_swallow_the_next():
    stream = JsonStream()
    assert stream.receive(b'{"id":"a","lat\n{"id":"b"}\n', 0) == [b'{"id":"b"}']
    assert stream.receive(b'{"id":1,\n{"id":"c"}\n', 0) == [b'{"id":"c"}']
    assert stream.receive(b'{"id":', 0) == []
    assert stream.receive(b'{"id":"d"}', 7_000_000) == [b'{"id":"d"}']
    assert stream.receive(b"{" * 5000, 8_000_000) == []
    assert stream.bad >= 3
