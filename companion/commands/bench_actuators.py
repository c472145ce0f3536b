"""``companion bench-actuators``: move thrusters and rudders on the bench, from −1 to 1 in steps of 0.1.

Shows what is commanded and what the board says it applies. ``--check`` asks about direction and trim instead, and names the
settings to change. A vessel that runs holds the port, so the bench never fights it: armed or not, it is refused.
"""

from __future__ import annotations

import argparse
import math
import select
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.messages import Action, ActuatorDemand

from ..core.board import ActuatorConfig, Arduino
from ..core.guard.gate import Evidence, Gate, GateConfig
from ..io.clock import SystemClock
from ..io.links import Link, open_link
from ..io.loop import StopFlag, run
from ..ports import ArduinoPort
from ..settings import Settings, load

CHANNELS: Final = ("thruster_port", "thruster_starboard", "rudder_port", "rudder_starboard")
PATIENCE_US: Final = 8_000_000
"""Time for the port to open and the board to answer."""
LOOK_US: Final = 500_000
"""A position is held this long before an answer counts: nobody has seen an output move that never got there."""
WARNING: Final = "Thrusters and rudders will move. Take the propellers off, or keep everybody clear of them."


@dataclass(frozen=True, slots=True)
class Step:
    """One position to hold. ``shares`` −1...1 in the order of CHANNELS; a question waits for its answer."""

    label: str
    shares: tuple[float, float, float, float]
    seconds: float
    question: str = ""
    mend: str = ""
    """What to change when the answer is no."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("bench-actuators", help="move the actuators on the bench", description=__doc__)
    parser.add_argument("config", type=Path, nargs="?", help="TOML file of the vessel (default: built-in defaults)")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument("--url", help="the board's port, e.g. serial:/dev/ttyACM0 (default: actuators.url)")
    parser.add_argument("--only", action="append", choices=CHANNELS, help="move only this output; may be given again")
    parser.add_argument("--limit", type=float, default=1.0, metavar="X", help="largest share of full, 0 to 1")
    parser.add_argument("--period", type=float, default=0.5, metavar="S", help="time at each step")
    parser.add_argument("--hold", type=float, metavar="X", help="hold this share instead of a sweep, until Ctrl-C")
    parser.add_argument("--check", action="store_true", help="ask about direction and trim of each output")
    parser.add_argument("--yes", action="store_true", help="do not ask whether everybody is clear")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Run the bench; exit status 0 done, 1 the board did not do it, 2 wrong usage."""
    settings = load(arguments.config, arguments.set, Settings)
    if not 0.0 < arguments.limit <= 1.0 or not 0.1 <= arguments.period <= 60.0:
        print("--limit must be above 0 and at most 1, --period 0.1 to 60 s", file=sys.stderr)
        return 2
    if arguments.hold is not None and not -1.0 <= arguments.hold <= 1.0:
        print("--hold must be -1 to 1", file=sys.stderr)
        return 2
    if not arguments.yes and not _confirmed():
        return 2
    baud = settings.actuators.baud
    url = arguments.url or settings.actuators.url
    link = open_link("actuators", url, **({} if baud is None else {"baud": baud}))
    bench = Bench(link, settings.actuators.board, list(plan(arguments)))
    stop = StopFlag().install()
    bench.stop = stop
    status = run(bench, SystemClock(), stop)
    for line in bench.findings:
        print(line)
    if bench.failure:
        print(bench.failure, file=sys.stderr)
    return 1 if bench.failure else status


def _confirmed() -> bool:
    print(WARNING)
    if not sys.stdin.isatty():
        print("no terminal to ask: say --yes", file=sys.stderr)
        return False
    return input("Type yes to go on: ").strip().lower() == "yes"


def plan(arguments: argparse.Namespace) -> Iterator[Step]:
    """Return the positions to go through."""
    wanted = tuple(arguments.only or CHANNELS)
    if arguments.check:
        yield from questions(wanted)
    elif arguments.hold is not None:
        shares = _shares(wanted, arguments.hold * arguments.limit)
        yield Step(f"hold {arguments.hold:+.1f}", shares, math.inf)
    else:
        for name in wanted:
            for tenths in range(-10, 11):
                share = tenths / 10 * arguments.limit
                yield Step(f"{name} {share:+.2f}", _shares((name,), share), arguments.period)


def questions(wanted: Sequence[str]) -> Iterator[Step]:
    """Return the direction and trim check of each output."""
    for name in wanted:
        thruster = name.startswith("thruster")
        at_rest = "stand still" if thruster else "stand amidships"
        ahead = (
            "push the vessel ahead"
            if thruster
            else "turn the vessel to starboard (its trailing edge goes to starboard)"
        )
        key = f"actuators.board.{name}"
        yield Step(
            f"{name} at rest",
            _shares((), 0.0),
            math.inf,
            f"Does {name} {at_rest}?",
            f"{key}.trim_us: change it by a few microseconds at a time (positive = ahead, starboard)",
        )
        yield Step(
            f"{name} +0.30",
            _shares((name,), 0.3),
            math.inf,
            f"Does {name} {ahead}?",
            f"{key}.reverse = true (or swap two of the motor's wires); if another output moves: {key}.id",
        )


def _shares(names: Sequence[str], share: float) -> tuple[float, float, float, float]:
    first, second, third, fourth = (share if name in names else 0.0 for name in CHANNELS)
    return first, second, third, fourth


class Bench:
    """What the loop drives: the board's port, one step after the other, neutral before and after."""

    def __init__(self, link: Link, config: ActuatorConfig, steps: Sequence[Step]) -> None:
        self.port = ArduinoPort(link, Arduino(config.model_copy(update={"allow_level0": True})))
        self.gate = Gate(GateConfig(rudder_max_deg=config.rudder_max_deg))
        self.stop = StopFlag()
        self.failure = ""
        self.findings: list[str] = []
        self._limit_rad = math.radians(config.rudder_max_deg)
        self._steps = list(steps)
        self._since_us: int | None = None
        self._first_us: int | None = None
        self._shown_us = -1_000_000
        self._was_ready = False

    @property
    def links(self) -> tuple[Link, ...]:
        return (self.port.link,)

    def pump(self, now_us: int) -> None:
        self.port.read(now_us)

    def shutdown(self, now_us: int) -> None:
        """Neutral, then let go."""
        self.port.write(self.gate.neutral(now_us, "bench over"), now_us)
        self.port.link.close()

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        """Read the board, hold the present step, go on when it is over."""
        self.pump(now_us)
        board = self.port.board
        ready, reason = board.ready(now_us)
        for _, text in board.drain_texts():
            print(text, flush=True)
        self._watch(now_us, ready, reason)
        shares = self._steps[0].shares if self._steps and not self.failure else (0.0, 0.0, 0.0, 0.0)
        demand = ActuatorDemand(now_us, shares[0], shares[1], shares[2] * self._limit_rad, shares[3] * self._limit_rad)
        evidence = Evidence(actuator_ready=ready, reason=reason, manual=True)
        self.port.write(self.gate.decide(now_us, demand, Action.NONE, armed=True, evidence=evidence), now_us)
        if ready:
            self._show(now_us)
            self._go_on(now_us)
        return self

    def _watch(self, now_us: int, ready: bool, reason: str) -> None:
        """Give up when the board does not come, or leaves."""
        if self._first_us is None:
            self._first_us = now_us
        if self._was_ready and not ready:
            self._fail(f"stopped: {reason}")
        elif not ready and now_us - self._first_us > PATIENCE_US:
            place = self.port.link.describe()
            mend = "; a vessel that runs holds its port: stop it first" if "in use" in place else ""
            self._fail(f"{place}: {reason}{mend}")
        self._was_ready = ready

    def _fail(self, text: str) -> None:
        self.failure = self.failure or text
        self.stop.stop(text)

    def _go_on(self, now_us: int) -> None:
        if not self._steps:
            self.stop.stop("done")
            return
        step = self._steps[0]
        if self._since_us is None:
            self._since_us = now_us
            if step.question:
                print(f"{step.question} [y/n] ", flush=True)
        if step.question:
            answer = _typed_line() if now_us - self._since_us >= LOOK_US else ""
            if not answer:
                return
            if answer.strip().lower() not in ("y", "yes"):
                self.findings.append(f"{step.label}: {step.mend}")
        elif now_us - self._since_us < step.seconds * 1e6:
            return
        self._steps.pop(0)
        self._since_us = None

    def _show(self, now_us: int) -> None:
        """Print commanded and applied pulses twice a second."""
        if now_us - self._shown_us < 500_000 or not self._steps:
            return
        self._shown_us = now_us
        board = self.port.board
        applied = board.status.applied_us
        volts = board.status.voltage_v
        print(
            f"{self._steps[0].label:26} commanded {_pulses(board.commanded_us)}  applied {_pulses(applied)}"
            f"  {'' if volts is None else f'{volts:.1f} V  '}{board.status.state}",
            flush=True,
        )


def _pulses(pulses: Sequence[int] | None) -> str:
    return "-" if pulses is None else " ".join(f"{pulse:4d}" for pulse in pulses)


def _typed_line() -> str:
    """Return a line that was typed, without waiting; empty when there is none."""
    if not select.select([sys.stdin], [], [], 0)[0]:
        return ""
    return sys.stdin.readline() or "n"
