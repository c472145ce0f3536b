"""Time on air against the published table (lora-link T2, computed from Semtech's formula)."""

import pytest

from mavlink_bridge.lora.airtime import PHYS, packet_us, write_us

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
