"""Real processes and the real firmware in real time: what the bench does with a board, and a port that is taken.

The chip runs in its own process on a pty; the companion is the bench command, which uses the vessel's own codec, gate and serial link.
"""

from __future__ import annotations

import os
import subprocess
import time

import pytest

from tests.firmware.bench_process import COMPANION, bench, end, heard

pytestmark = pytest.mark.e2e


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
