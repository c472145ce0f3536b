"""The vectors that the firmware's host tests read too: codec and board-side decoder in Python against them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from companion.core.board import wire
from sitl.board.arduino_decoder import Decoder, PulseCommand, Word

VECTORS = json.loads((Path(__file__).parents[2] / "firmware" / "vectors.json").read_text())


@pytest.mark.parametrize("vector", VECTORS["crc8"], ids=lambda v: v["text"] or "empty")
def test_crc(vector):
    assert wire.checksum(vector["text"].encode()) == int(vector["crc"], 16)


@pytest.mark.parametrize("vector", VECTORS["encode"], ids=lambda v: v["level1"][:-1])
def test_encode(vector):
    assert wire.encode_level0(vector["pulses"], "\n").decode() == vector["level0_newline"]
    assert wire.encode_level0(vector["pulses"], "").decode() == vector["level0_bare"]
    assert wire.encode_level1(vector["pulses"]).decode() == vector["level1"]


@pytest.mark.parametrize("vector", VECTORS["words"], ids=lambda v: v["body"])
def test_words_are_ten_bytes_without_id_letters(vector):
    line = wire.checked(vector["body"])
    assert line.decode() == vector["line"]
    assert len(line) == 10  # a reader of five-byte blocks keeps its step
    assert not set(line) & set(b"mMlL")


@pytest.mark.parametrize("vector", VECTORS["decode"], ids=lambda v: v["name"])
def test_decode(vector):
    decoder, pulses, words = Decoder(), [None] * 4, []
    decoder.strict = vector["strict"]
    now_us = 0

    def take(found):
        if isinstance(found, PulseCommand):
            decoder.strict = decoder.strict or found.checked
            for pin, pulse in found.pulses:
                pulses[pin] = pulse
        elif isinstance(found, Word):
            words.append(found.text)

    for byte in vector["send"].encode("latin-1"):
        now_us += 87
        take(decoder.byte(byte, now_us))
    take(decoder.silence(now_us + 10_000))
    assert (pulses, words, decoder.bad) == (vector["pulses"], vector["words"], vector["bad"])


@pytest.mark.parametrize(("wire_id", "pulse"), [("m", 999), ("m", 2001), ("x", 1500), ("mM", 1500), ("", 1500)])
def test_what_must_not_be_on_the_wire_is_refused(wire_id, pulse):
    with pytest.raises(ValueError, match="must be"):
        wire.group(wire_id, pulse)


@pytest.mark.parametrize("limit_ms", [199, 2001])
def test_silence_limit_is_bounded(limit_ms):
    with pytest.raises(ValueError, match="200 to 2000"):
        wire.silence_word(limit_ms)


def test_status_line():
    reader = wire.BoardLineReader()
    line = wire.checked("#S,C,1,23,4000000000,7,1750,1250,1500,1499,W,12650")
    assert reader.receive(line) == [
        wire.Status("active-checked", True, 23, 4_000_000_000, 7, (1750, 1250, 1500, 1499), "watchdog", 12.65)
    ]


def test_voltage_zero_is_unknown():
    line = wire.checked("#S,B,0,65535,0,0,1500,1500,1500,1500,P,0")
    (status,) = wire.BoardLineReader().receive(line)
    assert status.voltage_v is None


@pytest.mark.parametrize(
    "body",
    [
        "#S,C,1,23,40,7,1750,1250,1500,1499,W",
        "#S,C,2,23,40,7,1750,1250,1500,1499,W,0",
        "#S,Z,1,23,40,7,1750,1250,1500,1499,W,0",
        "#S,C,1,-3,40,7,1750,1250,1500,1499,W,0",
        "#S,C,1,23,99999999999,7,1750,1250,1500,1499,W,0",
        "#S,C,1,23,40,7,1750,1250,1500,1499,?,0",
        "#B,0,1.0,UNO,P",
        "#B,1,1.0,UNO",
        "#V,1,1.0,UNO,x",
        "#X,1",
        "m1500",
        "",
    ],
)
def test_a_line_that_is_not_exactly_right_is_nothing(body):
    reader = wire.BoardLineReader()
    assert reader.receive(wire.checked(body)) == []
    assert (reader.good, reader.bad) == (0, 1)


def test_overlong_line_loses_only_itself():
    reader = wire.BoardLineReader()
    lines = reader.receive(b"x" * 5000 + b"\n" + wire.checked("#B,1,1.0,UNO,P"))
    assert lines == [wire.Banner(1, "1.0", "UNO", "power-on")]
    assert reader.bad == 1


def test_the_lines_of_the_page_are_what_a_board_says():
    """Who writes a board of his own has the page alone."""
    page = (Path(__file__).parents[2] / "docs" / "ACTUATORS.md").read_text(encoding="utf-8")
    lines = [line for line in page.splitlines() if line.startswith(("#B,", "#V,", "#S,"))]
    found = [wire.parse_board_line(line.encode()) for line in lines]
    assert [type(each) for each in found] == [wire.Banner, wire.Version, wire.Status]
    assert f"At most {wire.LINE_MAX_BYTES}" in page.replace("\n ", "")
    assert f"Protocol: `{wire.PROTOCOL}`" in page
