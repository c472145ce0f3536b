"""The companion's side of the actuator line against a board, in virtual time, with faults on the wire between them.

No vessel and no water: what is watched is the pins. The board is the Python twin or the firmware on a simulated chip.

    bench = ActuatorBench(ArduinoTwin())
    bench.run(2.0)                      # start-up: neutral
    bench.thrust = 0.5
    bench.run(1.0)
    bench.board.pulses_us
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Final, Protocol

from companion.core.board import ActuatorConfig, Arduino
from companion.core.guard.gate import Evidence, Gate, GateConfig
from mavlink_bridge.language.messages import Action, ActuatorDemand, ActuatorOutput

RUDDER_MAX_RAD: Final = math.radians(30.0)
"""Of the default hull."""

Pulses = tuple[float, float, float, float]


class Board(Protocol):
    """What both boards offer."""

    @property
    def pulses_us(self) -> Pulses: ...
    def receive(self, data: bytes, now_us: int) -> None: ...
    def step(self, now_us: int) -> bytes: ...
    def reset(self, now_us: int, boot_loader_us: int = 0) -> None: ...
    def hang(self, now_us: int) -> None: ...
    def set_estop(self, pressed: bool) -> None: ...
    def set_voltage(self, volts: float) -> None: ...


class ActuatorBench:
    """Steps of 5 ms; every 50 ms the companion encodes what the gate lets through of ``thrust`` and ``rudder_rad``."""

    STEP_US = 5_000
    TICK_US = 50_000

    def __init__(self, board: Board, config: ActuatorConfig | None = None, *, seen: bool = False) -> None:
        self.board = board
        self.companion = Arduino(config or ActuatorConfig(), RUDDER_MAX_RAD, seen=seen)
        self.gate = Gate(GateConfig(), RUDDER_MAX_RAD, self.TICK_US)
        self.now_us = 0
        self.thrust = 0.0
        self.rudder_rad = 0.0
        self.armed = True
        self.alive = True
        """False: the companion's process is dead or stopped."""
        self.plugged = True
        """False: the port is gone."""
        self.accepts: int | None = None
        """Bytes that the port takes of each write; None = all."""
        self.to_board: Callable[[bytes], bytes] = lambda data: data
        self.to_companion: Callable[[bytes], bytes] = lambda data: data
        self.texts: list[str] = []
        self.written = b""
        """Everything that the port took, for tests on bytes."""
        self._next_tick_us = 0
        board.step(0)
        self.companion.opened(0)

    def run(self, duration_s: float, each: Callable[[], object] | None = None) -> None:
        """Let time pass; ``each`` is called after every step."""
        end_us = self.now_us + round(duration_s * 1e6)
        while self.now_us < end_us:
            self.step()
            if each is not None:
                each()

    def until(self, condition: Callable[[], bool], limit_s: float) -> float | None:
        """Run until the condition holds; return how long that took, s, or None past the limit."""
        start_us = self.now_us
        while not condition():
            if self.now_us - start_us >= limit_s * 1e6:
                return None
            self.step()
        return (self.now_us - start_us) * 1e-6

    def step(self) -> None:
        self.now_us += self.STEP_US
        said = self.board.step(self.now_us)
        if self.plugged and said:
            heard = self.to_companion(said)
            if self.alive:
                self.companion.receive(heard, self.now_us)
        if self.now_us >= self._next_tick_us:
            self._next_tick_us += self.TICK_US
            if self.alive:
                self._tick()

    def unplug(self) -> None:
        self.plugged = False
        self.companion.closed(self.now_us)

    def plug(self, *, resets: bool = False, boot_loader_us: int = 0) -> None:
        self.plugged = True
        if resets:
            self.board.reset(self.now_us, boot_loader_us)
        self.companion.opened(self.now_us)

    def stopped(self) -> bool:
        """Are all four pins at neutral (or without pulses)?"""
        return all(pulse == 0.0 or abs(pulse - 1500.0) < 10.0 for pulse in self.board.pulses_us)

    def _tick(self) -> None:
        ready, reason = self.companion.ready(self.now_us)
        demand = ActuatorDemand(self.now_us, self.thrust, self.thrust, self.rudder_rad, self.rudder_rad)
        evidence = Evidence(actuator_ready=ready, reason=reason)
        self._write(self.gate.decide(self.now_us, demand, Action.NONE, self.armed, evidence))
        self.texts += [text for _, text in self.companion.drain_texts()]

    def _write(self, output: ActuatorOutput) -> None:
        data = self.companion.encode(output, self.now_us)
        if not data:
            return
        taken = data if self.accepts is None else data[: self.accepts]
        self.companion.note_written(len(taken), len(data), self.now_us)
        self.written += taken
        if self.plugged and taken:
            self.board.receive(self.to_board(taken), self.now_us)


def noise(rng: random.Random, flip: float = 0.0, lose: float = 0.0) -> Callable[[bytes], bytes]:
    """Return a disturbance of a line: each byte is lost, or has one bit flipped, with these chances."""

    def disturb(data: bytes) -> bytes:
        kept = bytearray()
        for byte in data:
            if lose and rng.random() < lose:
                continue
            if flip and rng.random() < flip:
                byte ^= 1 << rng.randrange(8)
            kept.append(byte)
        return bytes(kept)

    return disturb
