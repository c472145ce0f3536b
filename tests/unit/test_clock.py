"""The clocks: monotonic whatever the calendar does, exact in virtual time, honest about an unset calendar."""

from __future__ import annotations

import os
import time

from companion.io.clock import EARLIEST_UTC_US, ManualClock, SystemClock


def test_row_34_a_jump_of_the_calendar_moves_no_timer(monkeypatch):
    clock = SystemClock()
    before_us, utc_us = clock.now_us(), clock.utc_us()
    real = time.time_ns
    for jump_s in (7 * 86_400, -30 * 365 * 86_400):
        monkeypatch.setattr(time, "time_ns", lambda jump_s=jump_s: real() + jump_s * 10**9)
        assert 0 <= clock.now_us() - before_us < 5_000_000
        shown = clock.utc_us()
        assert shown is None if jump_s < 0 else shown - utc_us > 6 * 86_400 * 10**6


def test_a_calendar_that_was_never_set_is_unknown(monkeypatch):
    monkeypatch.setattr(time, "time_ns", lambda: 86_400 * 10**9)
    assert SystemClock().utc_us() is None
    assert ManualClock().utc_us() is None
    assert ManualClock(5, EARLIEST_UTC_US).utc_us() == EARLIEST_UTC_US + 5


def test_a_million_ticks_are_exact():
    clock = ManualClock()
    for _ in range(1_000_000):
        clock.advance(50_000)
    assert clock.now_us() == 50_000_000_000
    assert clock.advance(-5) == 50_000_000_000


def test_waiting_in_virtual_time_is_a_jump_and_never_goes_back():
    clock = ManualClock(100)
    assert clock.sleep_until_us(500) is False
    clock.sleep_until_us(200)
    assert clock.now_us() == 500


def test_waiting_ends_when_bytes_come_or_the_time_is_up():
    clock = SystemClock()
    reading, writing = os.pipe()
    due_us = clock.now_us() + 20_000
    assert clock.sleep_until_us(due_us, [reading]) is False
    assert clock.now_us() >= due_us
    os.write(writing, b"x")
    assert clock.sleep_until_us(clock.now_us() + 60_000_000, [reading]) is True
    os.close(reading)
    os.close(writing)
    assert clock.sleep_until_us(clock.now_us() + 2_000, [reading, -1]) in (True, False)


def test_a_faster_clock_shows_more_time():
    clock = SystemClock(speed=50.0)
    before_us = clock.now_us()
    time.sleep(0.01)
    assert clock.now_us() - before_us >= 500_000
