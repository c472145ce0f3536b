"""Any byte string, however it is cut: the same measurements and counters, no exception, bounded memory."""

from __future__ import annotations

import random

from hypothesis import given, settings, strategies as st

from companion.core.nmea.line import frame
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from companion.core.nmea.sentences import KINDS
from tests.held import bytes_held, globals_of

CONFIG = NmeaConfig(earliest_year=1980)

_NUMBERS = "0 1 -1 -0.0 102436.00 235960 4111.1007380 00842.3729240 9999.9 150622 nan inf 1e999 360.0 1_0 23 2022 06 15"
_LETTERS = "A V N S E W T M D R HPR AVR ROLL PITCH"
_fields = st.sampled_from(["", *_NUMBERS.split(), *_LETTERS.split()])
_body = st.builds(
    lambda talker, kind, fields: ",".join([talker + kind, *fields]),
    st.sampled_from(["GP", "GN", "II", "", "P"]),
    st.sampled_from(sorted(KINDS)),
    st.lists(_fields, max_size=18),
).filter(str.isascii)
_sentence = _body.map(frame)
_piece = st.one_of(
    _sentence,
    st.builds(lambda line, at: line[:at], _sentence, st.integers(0, 60)),
    st.binary(max_size=40),
    st.sampled_from(
        [b"$", b"!", b"\\", b"*", b"\r\n", b"\x00", b"$GPGGA", b"x" * 300, b"$" + b"y" * 300, b"\\s:a*1C\\"]
    ),
)
_stream = st.lists(_piece, max_size=12).map(b"".join)


def run(chunks: list[bytes]) -> tuple[list[object], dict[str, int]]:
    reader = NmeaReader(CONFIG)
    found: list[object] = []
    for chunk in chunks:
        found += reader.receive(chunk, 1_000_000)
    found += reader.poll(2_000_000)
    return found, reader.counters


@given(_stream, st.integers(0, 2**32))
@settings(max_examples=300, deadline=None)
def test_whole_byte_by_byte_and_random_chunks_agree(stream: bytes, seed: int) -> None:
    whole = run([stream])
    assert run([stream[index : index + 1] for index in range(len(stream))]) == whole
    rng = random.Random(seed)
    cuts = sorted(rng.randrange(len(stream) + 1) for _ in range(5))
    assert run([stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]) == whole


@given(st.binary(max_size=2000))
@settings(max_examples=200, deadline=None)
def test_any_bytes_never_raise(data: bytes) -> None:
    found, counters = run([data])
    assert found == [] or counters["sentences"] > 0


@given(_body)
@settings(max_examples=500, deadline=None)
def test_any_field_values_never_raise_and_values_are_finite_and_bounded(body: str) -> None:
    found, _ = run([frame(body), frame("GPGGA,102437.00,4111.1,N,00842.3,W,4,10,0.9,2.1,M,52.3,M,,")])
    for item in found:
        for value in (getattr(item, name) for name in type(item).__slots__):
            assert value is None or value == value
        psi = getattr(item, "psi_rad", None)
        assert psi is None or -3.2 <= psi <= 3.2


def test_memory_is_bounded_whatever_a_stranger_sends() -> None:
    rng = random.Random(5)
    reader = NmeaReader(CONFIG)
    caches = globals_of("companion.core.nmea")
    before, held = bytes_held(reader, *caches), []
    for now_us in range(0, 120_000_000, 10_000_000):
        for _ in range(1000):
            kind = "".join(rng.choice("ABCDEFGHIJ") for _ in range(5))
            reader.receive(frame(f"{kind},1,2") + frame(f"{kind[:2]}HDT,1.0,T") + b"$GP" + rng.randbytes(40), now_us)
        reader.poll(now_us)
        held.append(bytes_held(reader, *caches))
    assert max(held) - before < 200_000
    assert held[-1] < held[6] + 5_000
