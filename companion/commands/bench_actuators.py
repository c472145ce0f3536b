"""``companion bench-actuators``: move thrusters and rudders on the bench, while a key is held.

From rest, by ramps, out to one side, to the other and back to rest, within 30 % of full unless ``--limit`` asks for more; let the key go
and all is neutral. Shows what is commanded and what the board says it applies. ``--check`` asks about direction and trim instead, and
names the settings to change; with a board that never answers (level 0) it is how a person confirms to have seen it move.
A vessel that runs holds the port, so the bench never fights it: armed or not, it is refused.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.messages import Action, ActuatorDemand, ActuatorOutput

from ..build import mute_board
from ..core.board import ActuatorConfig, Arduino
from ..core.guard.gate import Evidence, Gate, GateConfig
from ..core.hull.geometry import HullGeometry, geometry_of
from ..io.clock import SystemClock
from ..io.keeping import Store
from ..io.keeping.content import SaveValue
from ..io.links import Link, open_link
from ..io.loop import StopFlag, run
from ..io.writer import Writer
from ..ports import ArduinoPort
from ..settings import Settings, load, load_vessel
from .bench_keys import Keyboard

CHANNELS: Final = ("thruster_port", "thruster_starboard", "rudder_port", "rudder_starboard")
PATIENCE_US: Final = 8_000_000
"""Time for the port to open and the board to answer."""
TAKEN_US: Final = 2_000_000
"""And for a program that just ended to let go of the port: longer, it is one that stays."""
LOOK_US: Final = 500_000
"""A position is held this long before an answer counts: nobody has seen an output move that never got there."""
LIMIT: Final = 0.3
RAMP_PER_S: Final = 0.5
"""Share of full by which an output moves in a second: from rest to the usual limit in 0.6 s."""
NOBODY_US: Final = 60_000_000
"""So long the bench waits for somebody to hold a key, or to answer."""
_SETTLED: Final = 1e-6
WARNING: Final = "Thrusters and rudders will move. Take the propellers off, or keep everybody clear of them."


@dataclass(frozen=True, slots=True)
class BenchStep:
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
    parser.add_argument(
        "--limit",
        type=float,
        default=LIMIT,
        metavar="X",
        help="largest share of full, above 0 to 1 (default %(default)s)",
    )
    parser.add_argument("--period", type=float, default=0.5, metavar="S", help="time at each step")
    parser.add_argument("--hold", type=float, metavar="X", help="hold this share instead of a sweep")
    parser.add_argument("--check", action="store_true", help="ask about direction and trim of each output")
    parser.add_argument("--yes", action="store_true", help="do not ask whether everybody is clear")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Run the bench; exit status 0 done, 1 the board did not do it, 2 wrong usage."""
    settings = load(arguments.config, arguments.set, Settings)
    if not 0.0 < arguments.limit <= 1.0 or not 0.1 <= arguments.period <= 60.0:
        print("--limit must be above 0 and at most 1, --period 0.1 to 60 s", file=sys.stderr)
        return 2
    if arguments.hold is not None and not -arguments.limit <= arguments.hold <= arguments.limit:
        print(
            f"--hold must be within --limit, -{arguments.limit:g} to {arguments.limit:g}; above 0.3 say so: --limit 1",
            file=sys.stderr,
        )
        return 2
    if not arguments.yes and not _confirmed():
        return 2
    vessel, period_us = load_vessel(settings.vessel), settings.system.period_us
    baud = settings.actuators.baud
    url = arguments.url or settings.actuators.url
    link = open_link("actuators", url, **({} if baud is None else {"baud": baud}))
    bench = Bench(link, settings.actuators.board, list(plan(arguments)), geometry_of(vessel), period_us)
    stop = StopFlag().install()
    bench.stop = stop
    with bench.keys:
        status = run(bench, SystemClock(), stop, period_us=period_us)
    for line in bench.findings:
        print(line)
    if settings.actuators.board.level == "0" and bench.seen == set(CHANNELS) and not bench.findings:
        return _keep(settings.store, url)
    if bench.failure:
        print(bench.failure, file=sys.stderr)
    return 1 if bench.failure else status


def _keep(place: str, url: str) -> int:
    """Note in the vessel's store that a person has seen the outputs of the board at this address move."""
    if not place:
        print('store = "" keeps nothing: name a file, or this board will not arm', file=sys.stderr)
        return 1
    writer = Writer()
    store = Store(Path(place), writer)
    store.submit(SaveValue(mute_board(url), datetime.now(UTC).isoformat(timespec="seconds")))
    store.close()
    writer.close()
    kept = [done for done in store.completions() if done.ok and not done.text]
    print(
        f"noted in {place}: the board at {url} was seen moving" if kept else f"{place}: cannot be written", flush=True
    )
    return 0 if kept else 1


def _confirmed() -> bool:
    print(WARNING)
    if not sys.stdin.isatty():
        print("no terminal to ask: say --yes", file=sys.stderr)
        return False
    return input("Type yes to go on: ").strip().lower() == "yes"


def plan(arguments: argparse.Namespace) -> Iterator[BenchStep]:
    """Return the positions to go through."""
    wanted = tuple(arguments.only or CHANNELS)
    if arguments.check:
        yield from questions(wanted, arguments.limit)
    elif arguments.hold is not None:
        shares = _shares(wanted, arguments.hold)
        yield BenchStep(f"hold {arguments.hold:+.1f}", shares, math.inf)
    else:
        for name in wanted:
            for tenths in (*range(11), *range(9, -11, -1), *range(-9, 1)):
                share = tenths / 10 * arguments.limit
                yield BenchStep(f"{name} {share:+.2f}", _shares((name,), share), arguments.period)


def questions(wanted: Sequence[str], share: float) -> Iterator[BenchStep]:
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
        yield BenchStep(
            f"{name} at rest",
            _shares((), 0.0),
            math.inf,
            f"Does {name} {at_rest}?",
            f"{key}.trim_us: change it by a few microseconds at a time (positive = ahead, starboard)",
        )
        yield BenchStep(
            f"{name} {share:+.2f}",
            _shares((name,), share),
            math.inf,
            f"Does {name} {ahead}?",
            f"{key}.reverse = true (or swap two of the motor's wires); if another output moves: {key}.id",
        )


def _shares(names: Sequence[str], share: float) -> tuple[float, float, float, float]:
    first, second, third, fourth = (share if name in names else 0.0 for name in CHANNELS)
    return first, second, third, fourth


class Bench:
    """What the loop drives: the board's port, one step after the other, neutral before and after."""

    def __init__(
        self, link: Link, config: ActuatorConfig, steps: Sequence[BenchStep], hull: HullGeometry, period_us: int
    ) -> None:
        rudder_max_rad = hull.rudder_max_rad
        self.port = ArduinoPort(link, Arduino(config, rudder_max_rad, seen=True))
        self.gate = Gate(
            GateConfig(thruster_rate=RAMP_PER_S, rudder_rate_degps=RAMP_PER_S * math.degrees(rudder_max_rad)),
            rudder_max_rad,
            period_us,
        )
        self.keys = Keyboard()
        self.stop = StopFlag()
        self.failure = ""
        self.findings: list[str] = []
        self.seen: set[str] = set()
        """Outputs that a person has seen move the right way."""
        self._told = False
        self._limit_rad = rudder_max_rad
        self._steps = list(steps)
        self._asked = False
        self._held_us = 0
        """How long the present position has been held."""
        self._idle_us = 0
        self._last_us: int | None = None
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
        typed, moves = self.keys.read(now_us), self.keys.held(now_us)
        if "q" in typed or (ready and self.keys.closed and not moves):
            self._fail("ended: no key is held" if self.keys.closed else "ended")
        shares = self._steps[0].shares if self._steps and moves and not self.failure else (0.0, 0.0, 0.0, 0.0)
        demand = ActuatorDemand(now_us, shares[0], shares[1], shares[2] * self._limit_rad, shares[3] * self._limit_rad)
        evidence = Evidence(actuator_ready=ready, reason=reason, manual=True)
        output = self.gate.decide(now_us, demand, Action.NONE, armed=True, evidence=evidence)
        self.port.write(output, now_us)
        if ready:
            self._go_on(now_us, typed, moves, reached=_reached(output, demand))
        return self

    def _watch(self, now_us: int, ready: bool, reason: str) -> None:
        """Give up when the board does not come, or leaves."""
        if self._first_us is None:
            self._first_us = now_us
        place = self.port.link.describe()
        taken = "in use" in place
        if self._was_ready and not ready:
            self._fail(f"stopped: {reason}")
        elif not ready and now_us - self._first_us > (TAKEN_US if taken else PATIENCE_US):
            mend = "; a vessel that runs holds its port: stop it first" if taken else ""
            self._fail(f"{place}: {reason}{mend}")
        self._was_ready = ready

    def _fail(self, text: str) -> None:
        self.failure = self.failure or text
        self.stop.stop(text)

    def _go_on(self, now_us: int, typed: str, moves: bool, *, reached: bool) -> None:
        """Take time into account as it was spent: at the position, or waiting for somebody."""
        if not self._steps:
            self.stop.stop("done")
            return
        step, passed_us = self._steps[0], 0 if self._last_us is None else now_us - self._last_us
        self._last_us = now_us
        at_rest = not any(step.shares)
        self._prompt(step, at_rest)
        self._idle_us = 0 if moves or typed else self._idle_us + passed_us
        if self._idle_us > NOBODY_US:
            self._fail("ended: nobody holds a key")
        if reached and (moves or (at_rest and bool(step.question))):
            self._held_us += passed_us
        if moves and not step.question:
            self._show(now_us)
        if self._is_over(step, typed):
            self._steps.pop(0)
            self._held_us, self._asked = 0, False

    def _prompt(self, step: BenchStep, at_rest: bool) -> None:
        """Say what is wanted, once for a question and once for a whole sweep."""
        if self._asked:
            return
        self._asked = True
        if step.question:
            hold = "" if at_rest else f"Hold the space bar ({step.label}). "
            print(f"{hold}{step.question} [y/n] ", flush=True)
        elif not self._told:
            self._told = True
            print(
                "Hold the space bar: outputs move while it is held, and are neutral when you let go. q ends.",
                flush=True,
            )

    def _is_over(self, step: BenchStep, typed: str) -> bool:
        if not step.question:
            return self._held_us >= step.seconds * 1e6
        answer = next((letter for letter in reversed(typed) if letter in "yn"), "")
        if not answer or self._held_us < LOOK_US:
            return False
        if answer == "n":
            self.findings.append(f"{step.label}: {step.mend}")
        elif any(step.shares):
            self.seen.add(step.label.split()[0])
        return True

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


def _reached(output: ActuatorOutput, demand: ActuatorDemand) -> bool:
    """Whether the ramp has come to its end: nobody has seen an output move that never got there."""
    return (
        abs(output.thruster_port - demand.thruster_port) < _SETTLED
        and abs(output.thruster_starboard - demand.thruster_starboard) < _SETTLED
        and abs(output.rudder_port_rad - demand.rudder_port_rad) < _SETTLED
        and abs(output.rudder_starboard_rad - demand.rudder_starboard_rad) < _SETTLED
    )
