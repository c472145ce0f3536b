"""Time on air against the published table (lora-link T2, computed from Semtech's formula), and what profiles leave room for."""

import dataclasses

import pytest

from mavlink_bridge.language.messages import LogText, Severity
from mavlink_bridge.language.requests import Arm
from mavlink_bridge.radio.air.airtime import PHYS, packet_us, write_us
from mavlink_bridge.radio.air.profile import batch_bytes
from mavlink_bridge.radio.codec.batch import encode_batch
from mavlink_bridge.radio.codec.state_fields import RadioState
from mavlink_bridge.radio.codec.wire import OVERHEAD
from tools.lora_rig import Rig, profile

SIZES = (12, 20, 24, 40, 60, 62, 100, 200)
TABLE = {
    "A": (0.362, 0.461, 0.510, 0.707, 0.952, 0.952, 1.444, 2.673),
    "B": (0.362, 0.428, 0.494, 0.690, 0.887, 0.952, 1.411, 2.591),
    "SF12": (1.155, 1.319, 1.483, 1.974, 2.630, 2.793, 3.940, 7.217),
    "SF10": (0.289, 0.371, 0.371, 0.535, 0.698, 0.698, 1.026, 1.845),
    "SF9": (0.144, 0.185, 0.206, 0.288, 0.370, 0.370, 0.554, 1.005),
    "SF8": (0.082, 0.103, 0.113, 0.154, 0.205, 0.205, 0.308, 0.564),
    "SF7": (0.041, 0.057, 0.062, 0.082, 0.113, 0.118, 0.174, 0.318),
    "SF7W": (0.021, 0.028, 0.031, 0.041, 0.056, 0.059, 0.087, 0.159),
}


@pytest.mark.parametrize("name", TABLE)
def test_published_airtimes(name):
    for size, seconds in zip(SIZES, TABLE[name], strict=True):
        assert packet_us(size, PHYS[name]) * 1e-6 == pytest.approx(seconds, abs=0.00051)


def test_rate_of_the_reference_setting():
    assert PHYS["A"].bit_rate == pytest.approx(651.0, abs=0.1)
    assert PHYS["B"].bit_rate == pytest.approx(671.4, abs=0.1)


def test_long_writes_are_split_into_packets():
    assert write_us(200, PHYS["A"]) == 3 * packet_us(62, PHYS["A"]) + packet_us(14, PHYS["A"])
    assert write_us(0, PHYS["A"]) == 0


def test_a_module_header_costs_air():
    assert packet_us(62, PHYS["A"], header_bytes=2) * 1e-6 == pytest.approx(1.00, abs=0.01)


def test_batches_longer_than_a_packet_are_refused_with_their_mend():
    with pytest.raises(ValueError, match=r"link\.batch = 14: 62 bytes.*max_packet_s = 1; set link\.batch = 13"):
        profile("n-0.1", module_header_bytes=4)
    assert profile("n-0.1", module_header_bytes=4, link={"batch": 13}).link.batch == 13


@pytest.mark.parametrize("count", range(1, 15))
def test_a_batch_is_as_long_as_the_profile_takes_it_for(count):
    assert len(encode_batch([RadioState()] * count, 129)) + OVERHEAD == batch_bytes(count)


def test_states_too_close_for_a_plan_between_them_are_refused_with_their_mend():
    with pytest.raises(ValueError, match=r"link\.state_s = 1\.2: a piece of a plan.*set link\.state_s = 1\.7"):
        profile("bench", link={"state_s": 1.2})
    assert profile("bench", link={"state_s": 1.7}).link.state_s == 1.7


@pytest.mark.parametrize("header_bytes", [0, 8, 32])
def test_texts_and_reasons_keep_to_the_longest_packet(header_bytes):
    rig = Rig(profile("bench", module_header_bytes=header_bytes, link={"state_s": 5.0}))
    rig.settle()
    rig.vessel.refuse = "x" * 200
    rig.ask(Arm(True))
    circle = rig.vessel.snapshot
    words = (LogText(1, 0, Severity.WARNING, "y" * 200),)
    rig.vessel.snapshot = lambda now_us, tick: dataclasses.replace(circle(now_us, tick), texts=words)
    rig.run(20.0)
    assert max(size for _, size in rig.sent(0)) <= rig.profile.max_frame_bytes
