"""Our IMC bytes are those of two codecs that nobody here wrote: imcpy (DUNE's own code) and pyimclsts."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from mavlink_bridge import imc
from mavlink_bridge.imc.fields import LongRaw, LongText, ManyMessages, OneMessage, Scalar
from mavlink_bridge.imc.messages import ALL
from tests.imc_messages import captured, messages, wire_name

imcpy = pytest.importorskip("imcpy", reason="imcpy has no wheel for this Python")

HEADERS = st.builds(
    imc.Header,
    source=st.integers(0, 0xFFFF),
    destination=st.integers(0, 0xFFFF),
    utc_s=st.floats(0, 4e9),
    source_entity=st.integers(0, 255),
    destination_entity=st.integers(0, 255),
)


def as_imcpy(message: imc.Message):
    """The same message, made of the other library's classes."""
    found = getattr(imcpy, type(message).__name__)()
    for name, kind in imc.kinds_of(type(message)).items():
        value, wire = getattr(message, name), wire_name(name)
        match kind:
            case Scalar(code) if code in "fd":
                setattr(found, wire, value)
            case Scalar():
                old = getattr(found, wire)
                setattr(found, wire, value if type(old) is int else type(old)(value))
            case LongText() | LongRaw():
                setattr(found, wire, value)
            case OneMessage():
                if value is not None:
                    setattr(found, wire, as_imcpy(value))
            case ManyMessages():
                for item in value:
                    getattr(found, wire).append(as_imcpy(item))
    return found


def packed_by_imcpy(packet: imc.Packet) -> bytes:
    found, header = as_imcpy(packet.message), packet.header
    found.src, found.src_ent, found.dst, found.dst_ent, found.timestamp = (
        header.source,
        header.source_entity,
        header.destination,
        header.destination_entity,
        header.utc_s,
    )
    return found.serialize()


@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@pytest.mark.parametrize("wanted", ALL, ids=lambda each: each.__name__)
@given(st.data())
def test_every_message_has_the_bytes_of_dunes_own_code(wanted, data):
    packet = imc.Packet(data.draw(HEADERS), data.draw(messages(wanted)))
    ours = imc.encode(packet)
    assert ours == packed_by_imcpy(packet)
    assert imc.decode(ours) == packet
    assert imcpy.Packet.deserialize(ours).serialize() == ours


@pytest.mark.soak
@settings(max_examples=1000, suppress_health_check=[HealthCheck.too_slow], deadline=None)
@pytest.mark.parametrize("wanted", ALL, ids=lambda each: each.__name__)
@given(st.data())
def test_every_message_has_the_bytes_of_dunes_own_code_at_length(wanted, data):
    packet = imc.Packet(data.draw(HEADERS), data.draw(messages(wanted)))
    assert imc.encode(packet) == packed_by_imcpy(packet)


@pytest.mark.parametrize(("name", "raw"), captured().items())
def test_the_other_codec_reads_the_captured_packets_as_we_do(name, raw):
    assert packed_by_imcpy(imc.decode(raw)) == raw
