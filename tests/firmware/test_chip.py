"""What only the chip can show: pulse shapes, the watchdog with interrupts off, the wrap of its clock."""

from __future__ import annotations

from itertools import pairwise

import pytest

from companion.core.board import wire
from sitl.board.avr import AvrArduino

NEUTRAL = (1500, 1500, 1500, 1500)


@pytest.fixture(params=["uno", "mega"])
def chip(avr_build, request):
    avr_build(f"{request.param}_hang", "sim")
    chip = AvrArduino(f"{request.param}_hang")
    chip.step(0)
    yield chip
    chip.close()


def hold(chip, now_us, pulses, duration_ms):
    for _ in range(duration_ms // 50):
        chip.receive(wire.encode_level1(pulses), now_us)
        now_us += 50_000
        chip.step(now_us)
    return now_us


def test_frames_of_20_ms_and_widths_to_8_us(chip):
    now_us = hold(chip, 100_000, NEUTRAL, 200)
    now_us = hold(chip, now_us, (1000, 2000, 1234, 1777), 200)
    chip.take_pulses()
    hold(chip, now_us, (1000, 2000, 1234, 1777), 2000)
    pulses = chip.take_pulses()
    for pin, width in enumerate((1000, 2000, 1234, 1777)):
        own = [pulse for pulse in pulses if pulse.pin == pin]
        assert 98 <= len(own) <= 101
        assert all(abs(pulse.width_us - width) <= 8.0 for pulse in own)
        gaps = [b.rise_us - a.rise_us for a, b in pairwise(own)]
        assert all(abs(gap - 20_000) <= 10.0 for gap in gaps)


def test_all_pins_of_a_frame_change_together(chip):
    now_us = hold(chip, 100_000, NEUTRAL, 200)
    chip.take_pulses()
    for step in range(40):  # commands at every phase of the frame
        pulses = (1600, 1600, 1600, 1600) if step % 2 else (1400, 1400, 1400, 1400)
        chip.receive(wire.encode_level1(pulses), now_us)
        now_us += 43_000
        chip.step(now_us)
    frames = {}
    for pulse in chip.take_pulses():
        frames.setdefault(round((pulse.rise_us - 2_500 * pulse.pin) / 20_000), []).append(round(pulse.width_us, -2))
    whole = [widths for widths in frames.values() if len(widths) == 4]
    assert len(whole) > 70
    assert all(len(set(widths)) == 1 for widths in whole)


@pytest.mark.parametrize("word", ["#HANG1", "#HANG2"])
def test_hang_is_safe_within_300_ms(chip, word):
    """HANG2 also switches interrupts off: the pins go silent, and the watchdog restarts the chip."""
    now_us = hold(chip, 100_000, NEUTRAL, 200)
    now_us = hold(chip, now_us, (1800, 1800, 1600, 1600), 500)
    chip.take_pulses()
    chip.receive(wire.checked(word), now_us)
    said = chip.step(now_us + 600_000)
    late = [pulse for pulse in chip.take_pulses() if pulse.rise_us > now_us + 300_000]
    assert late
    assert all(abs(pulse.width_us - 1500) <= 8.0 for pulse in late)
    banners = [line for line in wire.BoardLineReader().receive(said) if isinstance(line, wire.Banner)]
    assert [banner.reset_cause for banner in banners] == ["watchdog"]


def test_the_clock_wraps_after_49_days_and_the_failsafe_holds(chip):
    chip.step(50_000)
    chip.poke(chip.symbol("timer0_millis"), (2**32 - 1_500).to_bytes(4, "little"))
    now_us = hold(chip, 60_000, NEUTRAL, 200)
    now_us = hold(chip, now_us, (1700, 1700, 1500, 1500), 2_000)
    assert chip.pulses_us[:2] == pytest.approx((1700, 1700), abs=8)
    chip.step(now_us + 440_000)
    assert chip.pulses_us[:2] == pytest.approx((1700, 1700), abs=8)
    chip.step(now_us + 530_000)
    assert chip.pulses_us == pytest.approx(NEUTRAL, abs=8)


def test_the_clock_wraps_while_stopped(chip):
    now_us = hold(chip, 60_000, NEUTRAL, 100)
    chip.step(now_us + 800_000)
    chip.poke(chip.symbol("timer0_millis"), (2**32 - 300).to_bytes(4, "little"))
    said = chip.step(now_us + 2_000_000)
    states = {line.state for line in wire.BoardLineReader().receive(said) if isinstance(line, wire.Status)}
    assert states == {"failsafe"}
    assert chip.pulses_us == pytest.approx(NEUTRAL, abs=8)


def test_equal_bytes_give_equal_pulses(avr_build):
    """Lock step is exact: two chips with the same input do the same to the cycle."""
    avr_build("uno", "sim")
    pulses = []
    for _ in range(2):
        chip = AvrArduino("uno")
        now_us = hold(chip, 0, NEUTRAL, 500)
        hold(chip, now_us, (1650, 1350, 1500, 1600), 1_000)
        pulses.append([(pulse.pin, pulse.rise_cycles, pulse.width_cycles) for pulse in chip.take_pulses()])
        chip.close()
    assert pulses[0] == pulses[1]
