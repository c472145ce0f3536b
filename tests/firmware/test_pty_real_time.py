"""Real processes and the real firmware in real time: a companion that dies, stops, or finds its port taken.

The chip runs in its own process on a pty and reports its pins by its own clock, told as the machine's monotonic time; the companion
is the bench command, which uses the vessel's own codec, gate and serial link. Stated tolerance: 60 ms for a loaded machine.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from tests.firmware.chip_process import Chip

pytestmark = pytest.mark.e2e

COMPANION = Path(sys.executable).parent / "companion"
LIMIT_S = 0.55
TOLERANCE_S = 0.06


def bench(link, *words, limit="1"):
    """The bench at full range, and a finger on the space bar."""
    process = subprocess.Popen(
        [COMPANION, "bench-actuators", "--url", f"serial:{link}", "--yes", "--limit", limit, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    threading.Thread(target=press, args=(process,), daemon=True).start()
    return process


def press(process):
    """Repeat the key as a keyboard does."""
    with contextlib.suppress(OSError, ValueError):
        while process.poll() is None:
            process.stdin.write(" ")
            process.stdin.flush()
            time.sleep(0.03)


def heard(process, limit_s=60.0):
    """All that it printed, once it has ended."""
    process.wait(limit_s)
    return process.stdout.read()


def end(process):
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.kill()
    process.wait()


@pytest.fixture
def chips(avr_build, tmp_path):
    avr_build("uno", "sim")
    made = []

    def make(count, **options):
        made.extend(Chip(tmp_path / f"port{len(made)}", **options) for _ in range(count))
        return made[-count:]

    yield make
    for chip in made:
        chip.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "stopped"])
def test_pins_are_neutral_within_550_ms_ten_of_ten(chips, how):
    """Rows 1 and 2, five boards at a time for each way to go."""
    boards = chips(5)
    processes = [
        bench(board.link, "--hold", "0.4", "--only", "thruster_port", "--only", "thruster_starboard")
        for board in boards
    ]
    try:
        for board in boards:
            board.wait(board.thrusting, 25.0)
        took_s = []
        for board, process in zip(boards, processes, strict=True):
            struck_s = time.monotonic()
            os.kill(process.pid, how)
            board.wait(board.stopped, 2.0)
            time.sleep(0.3)
            took_s.append(board.stopped_after_s(struck_s))
        print(f"{how.name}: neutral after {', '.join(f'{value:.3f}' for value in took_s)} s")
        assert all(value <= LIMIT_S + TOLERANCE_S for value in took_s), took_s
        assert all(board.stopped() for board in boards)
    finally:
        for process in processes:
            end(process)


def test_interrupt_writes_neutral_at_once(chips):
    (board,) = chips(1)
    process = bench(board.link, "--hold", "0.4")
    try:
        board.wait(lambda: board.pulses[0] > 1690, 25.0)
        process.send_signal(signal.SIGINT)
        struck_s = time.monotonic()
        assert process.wait(5) == 0
        time.sleep(0.2)
        assert board.stopped_after_s(struck_s) <= 0.25
    finally:
        end(process)


def test_the_seeds_value_generator_reaches_the_pins(chips):
    (board,) = chips(1)
    process = bench(board.link, "--only", "rudder_port", "--period", "0.1")
    output = heard(process, 90.0)
    assert process.returncode == 0, output
    seen = {round(pulses[2], -1) for _, pulses in board.reports}
    assert {1000, 1100, 1200, 1300, 1400, 1500, 1600, 1700, 1800, 1900, 2000} <= seen
    assert all(abs(pulses[0] - 1500) < 15 or pulses[0] == 0 for _, pulses in board.reports)
    time.sleep(0.1)
    assert board.stopped()


def test_a_board_reset_under_way_ends_the_bench_stopped(chips):
    (board,) = chips(1)
    process = bench(board.link, "--hold", "0.4")
    try:
        board.wait(lambda: board.pulses[0] > 1690, 25.0)
        board.order("reset 300")
        output = heard(process, 10.0)
        assert process.returncode == 1
        assert "stopped:" in output
        assert board.stopped() or board.pulses == (0, 0, 0, 0)
    finally:
        end(process)


def test_a_second_program_is_refused_and_told_who_holds_the_port(chips):
    """Row 18; also why the bench cannot run beside a vessel, armed or not."""
    (board,) = chips(1)
    first = bench(board.link, "--hold", "0.4")
    try:
        board.wait(lambda: board.pulses[0] > 1690, 25.0)
        second = bench(board.link, "--hold", "-0.4")
        output = heard(second, 25.0)
        assert second.returncode == 1
        assert "in use by" in output
        assert f"process {first.pid}" in output
        assert board.pulses[0] == pytest.approx(1700, abs=15)
    finally:
        end(first)


def test_a_stopped_board_does_not_block_the_companion(chips):
    """Row 10: the board's process is frozen; the companion notices at once and keeps its period."""
    (board,) = chips(1)
    process = bench(board.link, "--hold", "0.4")
    try:
        board.wait(lambda: board.pulses[0] > 1690, 25.0)
        os.kill(board.process.pid, signal.SIGSTOP)
        struck_s = time.monotonic()
        output = heard(process, 10.0)
        assert time.monotonic() - struck_s < 1.5  # 300 ms, and the end of a Python process
        assert "silent" in output
    finally:
        os.kill(board.process.pid, signal.SIGCONT)
        end(process)


def test_direction_and_trim_check_names_what_to_change(chips):
    """At a terminal: a question at rest, then the space bar, then the answer."""
    (board,) = chips(1)
    master, slave = os.openpty()
    words = ["bench-actuators", "--url", f"serial:{board.link}", "--yes", "--check", "--only", "rudder_starboard"]
    process = subprocess.Popen(
        [COMPANION, *words], stdin=slave, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    os.close(slave)
    try:
        said = until(process, "stand amidships?")
        time.sleep(0.8)
        assert board.stopped()
        os.write(master, b"y")
        said += until(process, "Hold the space bar")
        for _ in range(60):
            os.write(master, b" ")
            time.sleep(0.03)
        os.write(master, b"n")
        said += heard(process, 20.0)
    finally:
        end(process)
        os.close(master)
    assert process.returncode == 0, said
    assert "rudder_starboard +0.30: actuators.board.rudder_starboard.reverse = true" in said
    assert "trim_us" not in said
    assert any(abs(pulses[3] - 1650) < 15 for _, pulses in board.reports)


def until(process, words):
    """Read what it prints, up to the line with the words."""
    said = ""
    while words not in said:
        line = process.stdout.readline()
        assert line, said
        said += line
    return said


@pytest.mark.parametrize("words", [["--limit", "0"], ["--period", "0.01"], ["--hold", "0.4"]])
def test_bench_usage(words):
    done = subprocess.run([COMPANION, "bench-actuators", "--yes", *words], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert words[0] in done.stderr


def test_bench_asks_before_anything_moves():
    words = [COMPANION, "bench-actuators", "--url", "serial:/nonexistent"]
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "propellers off" in done.stdout
