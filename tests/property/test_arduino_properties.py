"""Whatever the input: pulses stay within bounds, the way back is the inverse, readers do not care how bytes are cut."""

from __future__ import annotations

from hypothesis import given, settings, strategies as st

from companion.core.board import wire
from companion.core.board.actuator_map import ActuatorConfig, ChannelConfig, pulses_to_demand, to_pulses
from companion.core.board.arduino import Arduino
from mavlink_bridge.language.messages import ActuatorOutput
from sitl.board.arduino_decoder import Decoder, PulseCommand
from sitl.board.arduino_twin import ArduinoTwin

ANY = st.floats(allow_nan=True, allow_infinity=True)
SHARE = st.floats(-1.0, 1.0)
PULSES = st.tuples(*[st.integers(1000, 2000)] * 4)
PIECES = st.one_of(
    st.binary(max_size=6),
    st.sampled_from([b"m1500", b"M1999\n", b"l15", b"*", b"\r\n", b"#VERS?*58\n", b"#S,C,1,", b".0"]),
    PULSES.map(wire.encode_level1),
)


@st.composite
def configs(draw):
    def channel(wire_id):
        zero = draw(st.integers(1480, 1520))
        return ChannelConfig(
            id=wire_id,
            encoding=draw(st.sampled_from(["bipolar", "duty"])),
            us_minus=draw(st.integers(1000, zero - 100)),
            us_zero=zero,
            us_plus=draw(st.integers(zero + 100, 2000)),
            reverse=draw(st.booleans()),
        )

    swap = draw(st.booleans())
    return ActuatorConfig(
        thruster_port=channel("M" if swap else "m"),
        thruster_starboard=channel("m" if swap else "M"),
        rudder_port=channel("l"),
        rudder_starboard=channel("L"),
    )


@settings(max_examples=150, deadline=None)
@given(configs(), ANY, ANY, ANY, ANY, st.integers(1000, 1470), st.integers(1530, 2000))
def test_row_19_every_pulse_is_within_the_bounds(config, a, b, c, d, lower, upper):
    config = config.model_copy(update={"lower_us": lower, "upper_us": upper})
    assert all(lower <= pulse <= upper for pulse in to_pulses(ActuatorOutput(0, a, b, c, d, ""), config, 0.5))


@settings(max_examples=150, deadline=None)
@given(configs(), st.floats(0.1, 1.5), SHARE, SHARE, SHARE, SHARE)
def test_the_way_back_is_the_inverse(config, limit, a, b, c, d):
    wanted = (a, b, c * limit, d * limit)
    got = pulses_to_demand(to_pulses(ActuatorOutput(0, *wanted, ""), config, limit), config, limit)
    assert all(abs(x - y) <= 0.0051 * scale for x, y, scale in zip(got, wanted, (1, 1, limit, limit), strict=True))


@settings(max_examples=150, deadline=None)
@given(st.lists(PIECES, max_size=30), st.data())
def test_board_lines_do_not_depend_on_how_they_are_cut(pieces, data):
    stream = b"".join(pieces)
    whole, bytewise, chunked = wire.BoardLineReader(), wire.BoardLineReader(), wire.BoardLineReader()
    lines = whole.receive(stream)
    assert [line for byte in stream for line in bytewise.receive(bytes([byte]))] == lines
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    parts = [stream[start:end] for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert [line for part in parts for line in chunked.receive(part)] == lines


@settings(max_examples=200, deadline=None)
@given(st.lists(PIECES, max_size=30), st.booleans())
def test_row_19_the_board_never_gives_out_a_value_out_of_range(pieces, strict):
    decoder = Decoder()
    decoder.strict = strict
    for now_us, byte in enumerate(b"".join(pieces)):
        found = decoder.byte(byte, now_us)
        if isinstance(found, PulseCommand):
            assert all(0 <= pin < 4 and 1000 <= pulse <= 2000 for pin, pulse in found.pulses)


@settings(max_examples=100, deadline=None)
@given(PULSES, st.booleans(), st.booleans())
def test_what_the_companion_encodes_the_board_applies(pulses, checked, batch):
    data = wire.encode_level1(pulses, batch=batch) if checked else wire.encode_level0(pulses, "\n")
    decoder, got = Decoder(), {}
    for now_us, byte in enumerate(data):
        found = decoder.byte(byte, now_us)
        if isinstance(found, PulseCommand):
            got.update(found.pulses)
    assert tuple(got[pin] for pin in range(4)) == pulses
    assert decoder.bad == 0


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(PIECES, st.integers(0, 400_000)), max_size=25))
def test_neither_side_raises_on_anything(steps):
    board, twin, now_us = Arduino(ActuatorConfig(), 0.5), ArduinoTwin(), 0
    board.opened(0)
    for piece, wait_us in steps:
        now_us += wait_us
        board.receive(piece, now_us)
        twin.receive(piece, now_us)
        board.receive(twin.step(now_us), now_us)
        twin.receive(board.encode(ActuatorOutput(now_us, 1.0, 1.0, 0.0, 0.0, ""), now_us), now_us)
        assert isinstance(board.ready(now_us)[0], bool)
        assert all(pulse == 0.0 or 1000 <= pulse <= 2000 for pulse in twin.pulses_us)
