"""COMMAND_LONG and COMMAND_INT come out of the air with the very bytes that went in, whatever they hold."""

import contextlib
import struct

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import Arm, Origin, Reply, Reposition, Result, SetMode, StartPlan
from mavlink_bridge.mavlink.commands.command import Command
from mavlink_bridge.mavlink.commands.table import Context
from mavlink_bridge.mavlink.wire.codec import Codec, decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer
from mavlink_bridge.radio.codec.bits import BitsError
from mavlink_bridge.radio.codec.command import decode_command, encode_command, is_command, trimmed
from mavlink_bridge.radio.codec.request import encode_request
from mavlink_bridge.radio.orders import meaning_of
from tools.benches.lora import disarm
from tools.lora_rig import Rig, profile

VESSEL = (1, 1)
NANS = (0x7FC00000, 0x7FC00001, 0x7F800001, 0xFFC00000, 0xFFFFFFFF)
words = st.one_of(
    st.sampled_from([0, 0x3F800000, 0xBF800000, 0x80000000, 0x7F800000, 0x42C80000, 0x3DCCCCCD, *NANS]),
    st.integers(0, 0xFFFFFFFF),
)
byte = st.integers(0, 255)
commands = st.one_of(st.sampled_from([400, 176, 300, 192, 193, 31010]), st.integers(0, 65535))
ids = st.one_of(st.sampled_from([(255, 190), (245, 190), (255, 230)]), st.tuples(byte, byte))
to = st.one_of(st.just(VESSEL), st.tuples(byte, byte))
longs = st.builds(
    lambda p, c, t, n: (76, struct.pack("<7IHBBB", *p, c, *t, n)), st.tuples(*[words] * 7), commands, to, byte
)
ints = st.builds(
    lambda p, c, t, r: (75, struct.pack("<7IHBBBBB", *p, c, *t, *r)),
    st.tuples(*[words] * 7),
    commands,
    to,
    st.tuples(byte, byte, byte),
)
others = st.tuples(st.integers(0, 0xFFFFFF), st.binary(max_size=45))
origins = st.builds(
    lambda message, source, home: Origin(message[0], message[1], source, home),
    st.one_of(longs, ints, others.filter(lambda item: item[0] not in (75, 76))),
    ids,
    st.booleans(),
)


def back(origin, target=VESSEL):
    return decode_command(encode_command(origin, target), target)


@settings(max_examples=400, deadline=None)
@given(origins)
def test_every_command_and_any_other_message_comes_back_to_the_byte(origin):
    got = back(origin)
    assert got.payload == trimmed(origin.payload)
    assert (got.message_id, got.source, got.home_item) == (origin.message_id, origin.source, origin.home_item)


@settings(max_examples=200, deadline=None)
@given(st.one_of(longs, ints), ids)
def test_a_command_means_aboard_what_it_meant_on_the_wire(message, source):
    sent = Codec(*source).seal(message[0], trimmed(message[1]))
    heard = decode(Deframer().receive(sent, 0)[0])
    origin = back(Origin(heard.get_msgId(), heard.get_payload(), (heard.get_srcSystem(), heard.get_srcComponent())))
    assert Codec(*origin.source).seal(origin.message_id, origin.payload) == sent
    command, target = Command.from_payload(origin.message_id, origin.payload, origin.source)
    assert repr(command) == repr(Command.from_message(heard)), "NaN included"
    assert target == (heard.target_system, heard.target_component)


@settings(max_examples=200, deadline=None)
@given(origins)
def test_it_never_takes_more_than_the_raw_escape_and_fits_a_frame(origin):
    data = encode_command(origin, VESSEL)
    assert len(data) <= len(trimmed(origin.payload)) + 9
    assert len(data) <= 55
    assert is_command(data)


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60))
def test_noise_is_refused_or_a_command_never_an_exception(data):
    context = Context(True, 2, 0, 0.5)
    with contextlib.suppress(BitsError):
        origin = decode_command(data, VESSEL)
        assert is_command(data)
        meaning_of(origin, context, VESSEL)


def long(command, *params, source=(255, 190), target=VESSEL):
    values = [*params, *([0.0] * (7 - len(params)))]
    message = dialect.MAVLink_command_long_message(*target, command, 0, *values)
    return Origin(76, Codec(*source).encode(message)[10:-2], source, home_item=True)


@pytest.mark.parametrize(
    ("origin", "most"),
    [
        (disarm()[1], 5),
        (long(400, 1.0), 6),
        (long(193, 0.0), 5),
        (long(185, 1.0), 6),
        (long(176, 1.0, 4.0), 6),
        (long(300), 5),
    ],
)
def test_usual_commands_are_short(origin, most):
    assert len(encode_command(origin, VESSEL)) <= most


def test_typed_requests_are_told_apart():
    assert not is_command(encode_request(SetMode(Mode.HOLD)))


@pytest.mark.parametrize(
    ("origin", "meant"),
    [
        (long(400, 0.0), Arm(False)),
        (long(300, 2.0, 3.0), StartPlan(1, 2)),
        (long(300, 9.0), Result.DENIED),
        (long(4711), Result.UNSUPPORTED),
        (long(400, 1.0, target=(9, 1)), Result.DENIED),
        (Origin(39, b"x", (255, 190)), Result.UNSUPPORTED),
    ],
)
def test_the_vessel_itself_says_what_it_means(origin, meant):
    found = meaning_of(back(origin), Context(True, 4, 0, None), VESSEL)
    assert found == meant if not isinstance(meant, Result) else isinstance(found, Reply) and found.result is meant


def test_over_the_air_the_vessel_gets_the_very_command_once():
    rig = Rig(profile("o-10"))
    rig.settle()
    nan = float("nan")
    message = dialect.MAVLink_command_int_message(1, 1, 6, 192, 1, 0, 2.5, 1.0, 0.0, nan, 411_812_345, -86_987_654, nan)
    origin = Origin(75, Codec(245, 190).encode(message)[10:-2], (245, 190), home_item=True)
    _, reply = rig.ask(Reposition(0.0, 0.0), origin=origin)
    rig.run(30.0)
    assert reply.result is Result.ACCEPTED
    assert rig.vessel.origins == [origin]
    (_, body), *rest = rig.vessel.executed
    assert (body.speed_mps, body.change_mode, rest) == (2.5, True, [])
    assert body.lat_rad == pytest.approx(0.71875, abs=1e-4)
