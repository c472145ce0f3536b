"""The Python board and the chip, fed the same random bytes: same counters, same state, same pins."""

from __future__ import annotations

import random

import pytest

from companion.core.board import wire
from sitl.board.arduino_twin import ArduinoTwin
from sitl.board.avr import AvrArduino

ALPHABET = b"mMlL0123456789*#\n\r.;-AF \x00\xff"


def piece(rng):
    """One thing that may come down the line."""
    kind = rng.randrange(8)
    if kind == 0:
        return bytes(rng.choice(ALPHABET) for _ in range(rng.randrange(1, 40)))
    pulses = [rng.choice((1500, 1500, 1480, 1600, 1999, 1000)) for _ in range(4)]
    if kind in (1, 2):
        return wire.encode_level0(pulses, rng.choice(["", "\n", "\r\n", "\0", ";"]))
    if kind == 3:
        return wire.checked(rng.choice(["#VERS?", "#NEUTR", "#ZERO0", "#T0300", "#T9999", "#WHAT?"]))
    line = bytearray(wire.encode_level1(pulses, batch=kind != 4))
    if kind == 5:
        line[rng.randrange(len(line))] ^= 1 << rng.randrange(8)
    if kind == 6:
        del line[rng.randrange(len(line))]
    return bytes(line)


def replay(board, steps):
    """Return the board's last status after the steps."""
    said, now_us = board.step(0), 100_000
    said += board.step(now_us)
    for data, wait_us in steps:
        board.receive(data, now_us)
        now_us += wait_us
        said += board.step(now_us)
    for _ in range(120):
        now_us += 1_000
        said += board.step(now_us)
    lines = [line for line in wire.BoardLineReader().receive(said) if isinstance(line, wire.Status)]
    return lines[-1]


@pytest.mark.parametrize("seed", range(20))
def test_same_bytes_same_board(avr_build, seed):
    avr_build("uno", "sim")
    rng = random.Random(seed)
    # Gaps are nothing (glued), or well away from the 5 ms that end a level-0 command.
    steps = [(piece(rng), rng.choice((0, 15_000, 40_000, 90_000))) for _ in range(rng.randrange(3, 30))]
    chip = AvrArduino("uno")
    on_chip, on_twin = replay(chip, steps), replay(ArduinoTwin(), steps)
    chip.close()
    assert (on_twin.strict, on_twin.good, on_twin.bad) == (on_chip.strict, on_chip.good, on_chip.bad)
    silent_ms = {on_twin.silent_ms, on_chip.silent_ms}
    if (
        min(silent_ms) > 45 and max(silent_ms) < 190
    ):  # past the servo frame, before a silence limit: no millisecond decides
        assert (on_twin.state, on_twin.applied_us) == (on_chip.state, on_chip.applied_us)
