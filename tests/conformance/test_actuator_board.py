"""One suite for both actuator boards: the Python twin, and the real firmware on simulated Uno and Mega chips.

Everything is seen at the pins and in the board's own lines, in virtual time. Deadlines are those of the fault matrix.
"""

from __future__ import annotations

import os
import random

import pytest

from companion.core.board import wire
from companion.core.guard.gate import GateConfig
from sitl.board import avr
from sitl.board.arduino_twin import ArduinoTwin
from tools.benches.cells.actuator_bench import ActuatorBench, noise

NEUTRAL = (1500, 1500, 1500, 1500)
AHEAD = (1700, 1300, 1650, 1450)
TOLERANCE_US = 10.0
"""Interrupts that meet delay an edge of the real chip by some microseconds."""
STEP_US = 1_000
FRAME_MS = 31
"""A new value begins with the next frame (20 ms); the last of the four pulses ends 10 ms later."""


@pytest.fixture(params=["twin", "uno", "mega"])
def board(request):
    """A board just switched on."""
    if request.param == "twin":
        yield ArduinoTwin()
        return
    missing = avr.missing_packages()
    if missing and os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail(f"missing packages: {' '.join(missing)}", pytrace=False)
    if missing:
        pytest.skip(f"missing packages: {' '.join(missing)}")
    chip = avr.AvrArduino(f"{request.param}_hang")
    yield chip
    chip.close()


class Line:
    """Raw bytes to the board, in steps of 1 ms."""

    def __init__(self, board):
        self.board = board
        self.now_us = 0
        self.said = board.step(0)

    def wait(self, ms):
        for _ in range(ms):
            self.now_us += STEP_US
            self.said += self.board.step(self.now_us)

    def send(self, data, ms=0):
        self.board.receive(data, self.now_us)
        self.wait(ms)

    def hold(self, pulses, ms):
        """Repeat a checked line every 50 ms."""
        for _ in range(ms // 50):
            self.send(wire.encode_level1(pulses), 50)

    def ms_until(self, pulses, limit):
        for passed in range(limit):
            if self.at(pulses):
                return passed
            self.wait(1)
        return None

    def at(self, pulses):
        return all(abs(a - b) <= TOLERANCE_US for a, b in zip(self.board.pulses_us, pulses, strict=True))

    def lines(self):
        reader = wire.BoardLineReader()
        found = reader.receive(self.said)
        assert reader.bad == 0
        self.said = b""
        return found

    def status(self):
        self.said = self.said[self.said.rfind(b"\n") + 1 :]
        self.wait(220)
        return [line for line in self.lines() if isinstance(line, wire.Status)][-1]


@pytest.fixture
def line(board):
    """Past the boot; banner still unread."""
    line = Line(board)
    line.wait(100)
    return line


@pytest.fixture
def checked(line):
    """Latched to the checked level, neutral commanded."""
    line.hold(NEUTRAL, 150)
    line.lines()
    return line


def test_neutral_from_the_first_frame_and_a_banner(line):
    assert line.at(NEUTRAL)
    banner = line.lines()[0]
    assert isinstance(banner, wire.Banner)
    assert (banner.protocol, banner.reset_cause) == (1, "power-on")


@pytest.mark.parametrize(
    "data", [b"m1750", b"m1750\n", b"m1750\r\n", b"m1750\0", b"m1750;", b"m1750.000000", b"\xffm1750\n"]
)
def test_level_0_acts_within_a_frame(line, data):
    line.send(data)
    assert line.ms_until((1750, 1500, 1500, 1500), 60) <= FRAME_MS + 7


def test_level_0_back_to_back(line):
    line.send(b"m1600M1601l1602L1603")
    assert line.ms_until((1600, 1601, 1602, 1603), 60) <= FRAME_MS + 8


@pytest.mark.parametrize("data", [b"m15001\n", b"m150\n", b"m-1500\n", b"m2001\n", b"m0999\n"])
def test_level_0_refuses(line, data):
    line.send(data, 60)
    assert line.at(NEUTRAL)
    assert line.status().bad == 1


def test_level_0_stops_after_a_second_of_silence(line):
    line.send(b"m1750\n", 950)
    assert line.at((1750, 1500, 1500, 1500))
    assert line.ms_until(NEUTRAL, 120) is not None
    assert line.status().state == "failsafe"


def test_a_checked_line_latches_the_checked_level(checked):
    checked.send(b"m1999\n", 60)
    assert checked.at(NEUTRAL)
    status = checked.status()
    assert (status.strict, status.bad) == (True, 1)


def test_interlock_until_both_thrusters_were_stopped(line):
    line.hold(AHEAD, 300)
    assert line.at((1500, 1500, 1650, 1450))  # rudders may move
    assert line.status().state == "interlock"
    line.send(wire.checked("m1500"), 30)
    line.hold(AHEAD, 100)
    assert line.at((1500, 1500, 1650, 1450))  # one thruster is not both
    line.hold((1520, 1480, 1500, 1500), 50)
    line.hold(AHEAD, 100)
    assert line.at(AHEAD)


def test_one_line_acts_in_one_frame(checked):
    checked.hold(AHEAD, 100)
    seen = set()
    checked.send(wire.encode_level1((1300, 1700, 1450, 1650)))
    for _ in range(40):
        checked.wait(1)
        seen.add(tuple(round(pulse / 50) for pulse in checked.board.pulses_us[:2]))
    # The second pulse of a frame comes 2.5 ms after the first; no frame mixes an old with a new pair for longer.
    assert (26, 34) in seen


def test_silence_stops_after_500_ms_and_needs_neutral(checked):
    checked.hold(AHEAD, 500)
    checked.wait(440)  # 490 ms since the last line
    assert checked.at(AHEAD)
    assert checked.ms_until(NEUTRAL, 60) is not None  # by 550 ms
    assert checked.status().state == "failsafe"
    checked.hold(AHEAD, 300)
    assert checked.at((1500, 1500, 1650, 1450))
    checked.hold(NEUTRAL, 50)
    checked.hold(AHEAD, 100)
    assert checked.at(AHEAD)


def test_the_silence_limit_can_be_set_within_bounds(checked):
    checked.send(wire.silence_word(200) + wire.checked("#T0199") + wire.checked("#T2001") + wire.checked("#VERS?"), 50)
    (version,) = [item for item in checked.lines() if isinstance(item, wire.Version)]
    assert version.silence_ms == 200
    checked.hold(AHEAD, 200)
    checked.wait(120)
    assert checked.at(AHEAD)
    assert checked.ms_until(NEUTRAL, 60) is not None


def test_all_neutral_word(checked):
    checked.hold(AHEAD, 200)
    checked.send(wire.checked(wire.ALL_NEUTRAL))
    assert checked.ms_until(NEUTRAL, 40) <= FRAME_MS + 2


def test_status_ten_times_a_second_shows_the_pins(checked):
    checked.hold(AHEAD, 100)
    checked.lines()
    checked.hold(AHEAD, 1000)
    lines = checked.lines()
    assert 9 <= len(lines) <= 11
    assert all(item.applied_us == AHEAD and item.state == "active-checked" and item.silent_ms <= 52 for item in lines)
    assert lines[-1].good - lines[0].good in range(16, 22)
    checked.send(wire.checked(wire.CLEAR_COUNTERS))
    assert checked.status().good == 0


def test_supply_voltage(checked):
    assert checked.status().voltage_v is None
    checked.board.set_voltage(12.6)
    assert checked.status().voltage_v == pytest.approx(12.6, abs=0.05)


def test_emergency_stop_input(checked):
    checked.hold(AHEAD, 200)
    checked.board.set_estop(True)
    checked.send(wire.encode_level1(AHEAD))
    assert checked.ms_until(NEUTRAL, 60) <= 10 + FRAME_MS + 2
    checked.hold(AHEAD, 300)
    assert checked.at(NEUTRAL)
    assert checked.lines()[-1].state == "emergency-stop"
    checked.board.set_estop(False)
    checked.hold(AHEAD, 300)
    assert checked.at((1500, 1500, 1650, 1450))  # released, but thrust needs neutral first
    checked.hold(NEUTRAL, 50)
    checked.hold(AHEAD, 100)
    assert checked.at(AHEAD)


def test_a_twitch_of_the_stop_input_is_nothing(checked):
    for _ in range(20):
        checked.board.set_estop(True)
        checked.wait(4)
        checked.board.set_estop(False)
        checked.wait(6)
        checked.send(wire.encode_level1(NEUTRAL))
    assert checked.status().state == "active-checked"


def test_reset_button(checked):
    checked.hold(AHEAD, 200)
    checked.lines()
    checked.board.reset(checked.now_us)
    checked.wait(60)
    assert checked.at(NEUTRAL)
    assert checked.lines()[0].reset_cause == "external"
    checked.hold(AHEAD, 200)
    assert checked.at((1500, 1500, 1650, 1450))


def test_boot_loader_keeps_the_pins_silent(checked):
    checked.hold(AHEAD, 200)
    checked.board.reset(checked.now_us, 1_000_000)
    checked.wait(100)
    assert checked.board.pulses_us == (0.0, 0.0, 0.0, 0.0)
    checked.wait(960)
    assert checked.at(NEUTRAL)


def test_a_hang_ends_in_neutral_within_300_ms_and_names_the_watchdog(checked):
    checked.hold(AHEAD, 200)
    checked.lines()
    checked.board.hang(checked.now_us)
    assert checked.ms_until(NEUTRAL, 301) is not None
    checked.wait(300)
    assert checked.at(NEUTRAL)
    banner = next(item for item in checked.lines() if isinstance(item, wire.Banner))
    assert banner.reset_cause == "watchdog"


def test_a_saturated_line_loses_nothing(checked):
    before = checked.status()
    data = b"".join(wire.encode_level1((1500, 1500, 1500 + step, 1500)) for step in range(400))
    checked.send(data, len(data) * 95 // 1000 + 20)
    after = checked.status()
    assert (after.good - before.good, after.bad - before.bad) == (400, 0)


def test_at_rest_the_chain_gives_1500_at_all_four_pins(board):
    bench = ActuatorBench(board)
    bench.run(2.0)
    assert bench.companion.ready(bench.now_us) == (True, "")
    assert bench.board.pulses_us == pytest.approx(NEUTRAL, abs=TOLERANCE_US)


def test_row_01_companion_dies_ten_times_out_of_ten(board):
    bench = ActuatorBench(board)
    for turn in range(10):
        bench.thrust, bench.alive = 0.0, True
        bench.run(0.5)
        bench.thrust = 0.6
        assert bench.until(lambda: not bench.stopped(), 1.0) is not None
        bench.run(0.3 + 0.007 * turn)
        bench.alive = False
        silent_since_us = bench.now_us - (bench.now_us % bench.TICK_US)
        assert bench.until(bench.stopped, 0.6) is not None
        assert bench.now_us - silent_since_us <= 550_000


def test_row_11_companion_sees_a_reset_and_starts_with_neutral(board):
    bench = ActuatorBench(board)
    bench.thrust = 0.5
    bench.run(1.5)
    assert not bench.stopped()
    board.reset(bench.now_us)
    bench.written = b""
    assert bench.until(lambda: "reset" in bench.companion.faults(bench.now_us), 0.2) is not None
    bench.run(0.1)
    after = bench.written[-24:]
    assert after == wire.encode_level1(NEUTRAL)
    assert bench.stopped()
    assert any("restarted (external)" in text for text in bench.texts)


def test_row_12_companion_sees_a_hang_within_350_ms(board):
    bench = ActuatorBench(board)
    bench.thrust = 0.5
    bench.run(1.5)
    board.hang(bench.now_us)
    faults = {"silent", "reset"}
    took_s = bench.until(lambda: bool(faults & set(bench.companion.faults(bench.now_us))), 0.5)
    assert took_s is not None
    assert took_s <= 0.35
    bench.run(0.3)
    assert bench.stopped()


def test_row_08_port_pulled_and_back(board):
    bench = ActuatorBench(board)
    bench.thrust = 0.5
    bench.run(1.5)
    bench.unplug()
    assert bench.companion.faults(bench.now_us) == ("lost",)
    assert bench.companion.ready(bench.now_us)[0] is False
    bench.armed = False  # what the failsafe does on 'lost'
    bench.run(0.6)
    assert bench.stopped()
    bench.plug()
    bench.written = b""
    bench.run(2.0)
    assert bench.written.startswith(wire.encode_level1(NEUTRAL))
    assert bench.stopped()  # armed by nobody
    bench.armed = True
    bench.run(0.5)
    assert not bench.stopped()


def test_bytes_wait_for_the_banner_after_a_boot_loader(board):
    bench = ActuatorBench(board)
    bench.unplug()
    bench.plug(resets=True, boot_loader_us=1_500_000)
    bench.written = b""
    bench.run(1.4)
    assert bench.written == b""
    bench.run(0.3)
    assert bench.written.startswith(wire.encode_level1(NEUTRAL))
    bench.run(1.0)
    assert bench.companion.ready(bench.now_us) == (True, "")


def test_row_14_row_15_noise_never_makes_a_wrong_pulse(board):
    bench = ActuatorBench(board)
    bench.run(1.0)
    rng = random.Random(5)
    bench.to_board = noise(rng, flip=0.005, lose=0.005)
    bench.to_companion = noise(rng, flip=0.002, lose=0.002)
    allowed, wrong = {1500}, []

    def look():
        if bench.companion.commanded_us:
            allowed.add(bench.companion.commanded_us[0])
        wrong.extend(
            pulse for pulse in bench.board.pulses_us[:2] if min(abs(pulse - known) for known in allowed) > TOLERANCE_US
        )

    for step in range(60):
        bench.thrust = (step % 7 - 3) * 0.2
        bench.run(0.5, look)
    assert not wrong
    assert len(allowed) >= 5


def test_row_14_heavy_noise_is_told_and_stops_thrust(board):
    bench = ActuatorBench(board)
    bench.thrust = 0.5
    bench.run(1.5)
    bench.to_board = bench.to_companion = noise(random.Random(3), flip=0.06)
    assert bench.until(lambda: not bench.companion.ready(bench.now_us)[0], 2.0) is not None
    assert {"garbage", "noise", "silent", "mismatch"} & set(bench.companion.faults(bench.now_us))


def test_row_20_full_ahead_to_full_astern_changes_no_faster_than_the_limit(board):
    """Row 20, also after the board's own failsafe: thrust comes back at the configured rate."""
    bench = ActuatorBench(board)
    bench.gate.configure(GateConfig(thruster_rate=1.0))
    bench.run(1.0)
    track = []

    def look():
        track.append(board.pulses_us[0])

    for thrust in (1.0, -1.0):
        bench.thrust = thrust
        bench.run(1.5, look)
    bench.alive = False
    bench.run(0.8)
    assert bench.stopped()
    bench.alive = True
    bench.run(2.0, look)
    assert max(track) > 1950
    assert min(track) < 1050
    # Away from neutral 500 us/s; pulses come every 20 ms, commands every 50 ms. Toward neutral a step is free.
    away = [
        abs(new - 1500) - abs(old - 1500)
        for old, new in zip(track, track[10:], strict=False)
        if (old - 1500) * (new - 1500) > 0
    ]
    assert max(away) <= 500 * (0.05 + 0.05) + 2 * TOLERANCE_US
