"""``companion bench-actuators`` at the pins of a board, with a person's fingers for a keyboard. Virtual time."""

from __future__ import annotations

import argparse
import itertools

import pytest

from companion.commands.bench_actuators import CHANNELS, LIMIT, Bench, plan
from companion.commands.bench_keys import FIRST_US, REPEAT_US, Keyboard
from companion.core.board.actuator_map import ActuatorConfig
from companion.core.hull.geometry import HullGeometry
from companion.io.links.mem import MemLink
from sitl.board.arduino_twin import ArduinoTwin

TICK_US = 50_000


class Fingers(Keyboard):
    """Keys that a test presses."""

    def __init__(self) -> None:
        super().__init__()
        self.down = False
        self.typed = ""

    def read(self, now_us: int) -> str:
        typed, self.typed = self.typed, ""
        return typed

    def held(self, now_us: int) -> bool:
        return self.down


class Rig:
    """The bench, its board, and what its pins did."""

    def __init__(self, *words: str, level1: bool = True, **config: object) -> None:
        arguments = argparse.Namespace(only=None, check=False, hold=None, limit=LIMIT, period=0.1)
        for word in words:
            name, _, value = word.partition("=")
            setattr(arguments, name, [value] if name == "only" else (float(value) if value else True))
        near, self.far = MemLink("actuators"), MemLink("board")
        near.connect(self.far)
        self.bench = Bench(
            near, ActuatorConfig(**config), list(plan(arguments)), HullGeometry(rudder_max_rad=0.5), 50_000
        )
        self.keys = self.bench.keys = Fingers()
        self.board = ArduinoTwin(level1=level1)
        self.now_us = 0
        self.pins: list[tuple[float, ...]] = []

    def run(self, seconds: float) -> Rig:
        until_us = self.now_us + round(seconds * 1e6)
        while self.now_us < until_us and not self.bench.stop.raised:
            self.now_us += 5_000
            for event in self.far.poll(self.now_us):
                if hasattr(event, "data"):
                    self.board.receive(event.data, self.now_us)
            said = self.board.step(self.now_us)
            if said:
                self.far.write(0, said)
            if self.now_us % TICK_US == 0:
                self.bench.tick(self.now_us)
                self.pins.append(tuple(self.board.pulses_us))
        return self

    def widest_us(self, pin: int = 0) -> float:
        return max(abs(pins[pin] - 1500.0) for pins in self.pins if pins[pin])

    @property
    def neutral(self) -> bool:
        return all(abs(pulse - 1500.0) < 1.0 for pulse in self.board.pulses_us)


def test_nothing_moves_until_a_key_is_held_and_nothing_after():
    rig = Rig().run(8.0)
    assert rig.widest_us() < 1.0
    rig.keys.down = True
    rig.run(2.0)
    assert not rig.neutral
    rig.keys.down = False
    rig.run(0.15)
    assert rig.neutral
    rig.run(5.0)
    assert rig.neutral


def test_a_sweep_starts_at_rest_ramps_and_stays_within_thirty_percent():
    rig = Rig("only=thruster_port").run(3.0)
    rig.keys.down = True
    rig.run(60.0)
    assert rig.bench.failure == ""
    assert rig.bench.stop.raised
    moved = [pins[0] for pins in rig.pins]
    steps_us = [abs(b - a) for a, b in itertools.pairwise(moved)]
    assert max(steps_us) <= 0.5 * 0.05 * 500 + 6.0, "half of full in a second at the most"
    assert 140.0 < rig.widest_us() < 152.0
    assert min(moved) < 1360.0 < 1640.0 < max(moved)
    assert rig.widest_us(1) < 1.0


def test_full_range_only_when_asked_for():
    rig = Rig("only=rudder_port", "limit=1").run(3.0)
    rig.keys.down = True
    rig.run(120.0)
    assert 495.0 < rig.widest_us(2) <= 500.0


def test_a_check_asks_at_rest_then_moves_while_held_and_takes_an_answer_only_after_a_look(capsys):
    rig = Rig("check").run(4.0)
    assert "stand still? [y/n]" in capsys.readouterr().out
    for _ in CHANNELS:
        rig.keys.typed = "y"
        rig.run(0.1)
        rig.keys.typed = "y"
        rig.run(0.3)
        assert rig.neutral
        rig.keys.down = True
        rig.run(1.5)
        assert not rig.neutral
        rig.keys.down, rig.keys.typed = False, "y"
        rig.run(1.0)
    assert rig.bench.stop.raised
    assert rig.bench.seen == set(CHANNELS)
    assert rig.bench.findings == []


def test_an_output_that_nobody_saw_move_is_a_finding():
    rig = Rig("check", "only=thruster_port").run(4.0)
    rig.keys.typed = "y"
    rig.run(0.2)
    rig.keys.down = True
    rig.run(1.5)
    rig.keys.typed = "n"
    rig.run(0.5)
    assert rig.bench.seen == set()
    assert "thruster_port.reverse" in rig.bench.findings[0]


def test_a_mute_line_is_no_board_and_the_owners_level_0_is():
    mute = Rig(level1=False).run(20.0)
    assert "baud" in mute.bench.failure
    owned = Rig("only=thruster_port", level1=False, level="0").run(4.0)
    owned.keys.down = True
    owned.run(3.0)
    assert owned.widest_us() > 50.0
    owned.keys.down = False
    owned.run(0.2)
    assert owned.neutral


def test_nobody_at_the_keys_ends_it():
    rig = Rig().run(70.0)
    assert rig.bench.stop.raised
    assert "nobody" in rig.bench.failure


@pytest.mark.parametrize(
    ("gap_us", "repeats", "held"), [(FIRST_US - 1, 1, True), (FIRST_US, 1, False), (REPEAT_US, 5, False)]
)
def test_a_key_counts_as_held_longer_before_it_repeats(monkeypatch, gap_us, repeats, held):
    keys = Keyboard()
    monkeypatch.setattr("companion.commands.bench_keys.select.select", lambda *_: ([0], [], []))
    monkeypatch.setattr("companion.commands.bench_keys.os.read", lambda *_: b" ")
    for number in range(repeats):
        keys.read(number * 33_000)
    assert keys.held((repeats - 1) * 33_000 + gap_us) is held
