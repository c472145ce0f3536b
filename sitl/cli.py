"""``companion sim``: the simulated vessel with all its links, or a world for a separate ``companion run``."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
import time
from pathlib import Path
from typing import Any, TextIO

import config as shipped
from companion.build import in_run_dir
from companion.commands.log_lines import never_waiting
from companion.commands.numbers import positive, whole
from companion.commands.progress import ProgressLine
from companion.commands.run import describe
from companion.commands.stations import places
from companion.commands.status import StatusView, Views, Watched, airtime_of
from companion.configuration import link_mistakes, mistakes_of, radio_key_mistakes, vessel_mistakes
from companion.doors import gateway_doors, served_doors, vessel_doors
from companion.gateway import Gateway
from companion.io.clock import Clock, ManualClock, SystemClock
from companion.io.log_file import make_own_folder
from companion.io.loop import LoopApp, StopFlag, run
from companion.io.recording import new_run_dir
from companion.settings import ConfigError, load, load_vessel
from companion.status.start import serve
from companion.strangers import Lookout
from companion.worlds import apart, check_run_dir

from . import again, cli_encounters, cli_scenario, imc, rehearsal
from .gateway import WithGateway, shore_gateway, vessel_words, with_gateway
from .scenario.autostart import AutoStart, AutostartError, read_plan_file
from .world import SimSettings, World
from .world.instance import move_instance, moved_words
from .world.settings import STATION_SPEED, at_speed, on_this_computer
from .world.surroundings import Surroundings, served


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("sim", help="run the simulated vessel", description=__doc__)
    parser.add_argument(
        "--config", type=Path, default=shipped.path("sim.toml"), help="TOML file (default: config/sim.toml)"
    )
    parser.add_argument("--plan", type=Path, metavar="F", help="load a plan: QGC .plan, WPL 110 or the seed's JSON")
    parser.add_argument("--start", action="store_true", help="arm and start the plan; needs no ground station")
    parser.add_argument(
        "--speed", default="1", metavar="N|max", help="times real time; 'max' runs in lock-step, in memory"
    )
    parser.add_argument("--duration", type=positive, metavar="S", help="end after so many simulated seconds")
    parser.add_argument("--seed", type=whole(), help="of all random sources (default: 0, or what a scenario says)")
    parser.add_argument(
        "--run-dir", type=Path, help="where the run is recorded (default: a new one in record.directory)"
    )
    parser.add_argument("--json", action="store_true", help="print one summary object at the end")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument(
        "--instance", type=whole(), default=0, metavar="N", help="move ports by 10 N and the system id by N"
    )
    parser.add_argument(
        "--arduino", choices=("twin", "firmware"), help="the actuator board: Python twin, or the real AVR binary"
    )
    parser.add_argument(
        "--gateway", action="store_true", help="start the shore side of the radio too: stations at UDP 14560"
    )
    parser.add_argument("--imc", action="store_true", help="start the bridge to IMC consoles (Neptus) too")
    parser.add_argument("--world-only", action="store_true", help="serve the world to a separate 'companion run'")
    rehearsal.add_arguments(parser)
    cli_scenario.add_arguments(parser)
    cli_encounters.add_arguments(parser)
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Run the simulator; exit status 0 done, 1 a plan did not start or the run is not whole on the disk, 2 wrong usage."""
    if arguments.encounters is not None:
        return cli_encounters.command(arguments)
    if arguments.scenario or arguments.list_scenarios or arguments.campaign or arguments.cluster:
        return cli_scenario.command(arguments)
    arguments.seed = arguments.seed or 0
    boat, speed = _settings(arguments)
    settings = at_speed(apart(boat, arguments.set), speed)
    run_dir = arguments.run_dir or new_run_dir(Path(settings.record.directory))
    check_run_dir(run_dir, boat.record.directory)
    make_own_folder(run_dir)
    if arguments.gateway:
        settings = with_gateway(settings, run_dir)
    stop = StopFlag().install()
    until_us = None if arguments.duration is None else round(arguments.duration * 1e6)
    if arguments.world_only:
        return _serve_world(settings, arguments, run_dir, stop, until_us)
    plan = _plan(arguments)
    bridge = _bridge(arguments, settings, speed, run_dir)
    world = World(
        settings,
        arguments.seed,
        run_dir=run_dir,
        real_links=speed is not None,
        store=rehearsal.store_of(boat, arguments, run_dir, in_memory=speed is None),
        about=describe(settings, seed=arguments.seed),
    )
    again.moor(arguments, world)
    starter = AutoStart(world, plan, start=arguments.start) if plan is not None else None
    clock: Clock = ManualClock() if speed is None else SystemClock(speed)
    gateway = shore_gateway(world.settings, arguments.instance, run_dir) if arguments.gateway else None
    if not arguments.json:
        _greet(world, run_dir, speed, gateway)
        if boat.store:
            print(f"  store    the simulation's own; {boat.store} of {arguments.config} is left alone", flush=True)
    began = time.monotonic()
    driven: LoopApp = starter or world
    if gateway is not None:
        driven = WithGateway(driven, gateway, lambda: world.now_us)
    if speed is not None:
        never_waiting()
        airtime = airtime_of(world.app.grounds)
        service = serve(world.app, run_dir, say=world.tell, airtime_fn=airtime, speed=speed)
        lookout = Lookout([port.link for port in world.app.grounds], world.tell)
        driven = Watched(driven, lookout if service is None else Views(lookout, service))
        if not arguments.json and sys.stdout.isatty():
            driven = Watched(driven, StatusView(speed=speed, airtime=airtime))
    if speed is None and sys.stderr.isatty():
        driven = Watched(driven, ProgressLine("simulating", arguments.duration))
    with imc.beside(bridge) if bridge else contextlib.nullcontext():
        status = run(driven, clock, stop, period_us=world.period_us, until_us=until_us)
    status = _tell_the_end(arguments, world, time.monotonic() - began, run_dir) or status
    if again.is_wanted(world) and speed is not None:
        print(again.TOLD, flush=True)
        return command(again.next_start(arguments, world, run_dir))
    return 1 if starter is not None and starter.failure else status


def _tell_the_end(arguments: argparse.Namespace, world: World, wall_s: float, run_dir: Path) -> int:
    """The last lines; 1 when the run is not whole on the disk."""
    if arguments.json:
        print(json.dumps(summary(world, wall_s, arguments.seed, run_dir)))
    else:
        _farewell(world, wall_s, run_dir)
    missing = world.not_recorded()
    if missing:
        print(f"NOT recorded in {run_dir}: {missing}", file=sys.stderr, flush=True)
    return 1 if missing else 0


def _bridge(arguments: argparse.Namespace, settings: SimSettings, speed: float | None, run_dir: Path) -> list[str]:
    if arguments.imc and speed is None:
        raise ConfigError("--imc", ["--imc with --speed max: a console lives in real time; leave --speed out"])
    return imc.words(settings, arguments.instance, run_dir) if arguments.imc else []


def summary(world: World, wall_s: float, seed: int, run_dir: Path) -> dict[str, Any]:
    """Return what ``--json`` prints."""
    duration_s = world.now_us * 1e-6
    return {
        "duration_s": duration_s,
        "wall_s": round(wall_s, 3),
        "speed_up": round(duration_s / wall_s, 1) if wall_s > 0 else None,
        "seed": seed,
        "run_dir": str(run_dir),
        "distance_m": round(world.metrics.distance_m, 2),
        "plan_state": world.snapshot.progress.state.name if world.snapshot else None,
        "items": world.metrics.summary(),
    }


def _settings(arguments: argparse.Namespace) -> tuple[SimSettings, float | None]:
    overrides = list(arguments.set)
    if arguments.start:
        overrides.insert(0, "operator.gcs_required=false")
    if arguments.arduino:
        overrides.append(f"world.arduino={arguments.arduino}")

    def placed(settings: SimSettings) -> SimSettings:
        if not arguments.world_only:  # a separate vessel looks for its world where its own file says
            settings = on_this_computer(settings)
        return move_instance(rehearsal.placed(settings, arguments), arguments.instance)

    def misplaced(settings: SimSettings) -> list[str]:
        try:
            away = rehearsal.mistakes(settings, arguments)
            if away:
                return away
            if arguments.world_only:
                return link_mistakes(placed(settings)) + _hull_mistakes(settings.world.vessel)
            no_key = [] if arguments.gateway else radio_key_mistakes(settings)  # the simulated gateway brings its own
            return vessel_mistakes(placed(settings)) + no_key + _hull_mistakes(settings.world.vessel)
        except ConfigError as error:
            return list(error.mistakes)

    speed, mistakes = _usage(arguments)
    try:
        settings = load(arguments.config, overrides, SimSettings, further=misplaced)
    except ConfigError as error:
        raise ConfigError(error.source, [*error.mistakes, *mistakes]) from None
    if mistakes:
        raise ConfigError(str(arguments.config), mistakes)
    return placed(settings), speed


def _hull_mistakes(name: str) -> list[str]:
    """What is wrong with the hull that is really there."""
    found = mistakes_of(lambda: load_vessel(name)) if name else []
    return [f"world.{mistake}" if mistake.startswith("vessel = ") else mistake for mistake in found]


def _usage(arguments: argparse.Namespace) -> tuple[float | None, list[str]]:
    """The wanted speed (None: as fast as it goes), and what of the command line cannot be meant."""
    mistakes: list[str] = []
    speed: float | None = None
    if arguments.speed != "max":
        try:
            speed = float(arguments.speed)
        except ValueError:
            speed = 0.0
        if not 0.0 < speed <= 1000.0:
            mistakes.append(f"--speed {arguments.speed}: give a number up to 1000, or max")
    if arguments.start and arguments.plan is None:
        mistakes.append("--start: needs --plan F")
    if speed is None and arguments.gateway:
        mistakes.append("--gateway: ground stations cannot keep up with --speed max; give a number")
    if arguments.world_only and arguments.plan is not None:
        mistakes.append("--world-only: --plan goes to the vessel, which is another process: companion plan upload")
    if speed is None and arguments.world_only:
        mistakes.append("--world-only: a separate process cannot keep up with --speed max; give a number")
    return speed, mistakes


def _plan(arguments: argparse.Namespace) -> Any:
    if arguments.plan is None:
        return None
    try:
        return read_plan_file(arguments.plan)
    except AutostartError as error:
        raise ConfigError(str(arguments.plan), error.mistakes) from None


class WorldOnly:
    """Surroundings driven by the loop. What the board's pins do is written to ``board.csv``, a row for each tick."""

    def __init__(self, surroundings: Surroundings, pins: TextIO) -> None:
        self._surroundings = surroundings
        self._pins = pins
        self.links = surroundings.links
        pins.write("t_s,thruster_1_us,thruster_2_us,rudder_1_us,rudder_2_us,north_m,east_m\n")

    def pump(self, now_us: int) -> None:
        self._surroundings.pump(now_us)

    def tick(self, now_us: int, *, late_s: float = 0.0, load: float = 0.0) -> object:
        truth = self._surroundings.step(now_us)
        pulses = ",".join(f"{pulse:.1f}" for pulse in self._surroundings.plant.board.pulses_us)
        self._pins.write(f"{now_us * 1e-6:.3f},{pulses},{truth.north_m:.3f},{truth.east_m:.3f}\n")
        self._pins.flush()
        return truth

    def shutdown(self, now_us: int) -> None:
        self._surroundings.close()


def _serve_world(
    settings: SimSettings, arguments: argparse.Namespace, run_dir: Path, stop: StopFlag, until_us: int | None
) -> int:
    placed = in_run_dir(settings, run_dir)
    hull = load_vessel(settings.world.vessel or settings.vessel)
    surroundings = Surroundings(placed, hull, arguments.seed, shore_url=f"pty:{run_dir}/lora")
    vessel = " ".join(
        ["companion run CONFIG --simulated --run-dir", str(run_dir), *moved_words(settings, arguments.instance)]
    )
    print(f"serving the world in {run_dir}; start the vessel with: {vessel}", flush=True)
    for link in surroundings.links:
        print(f"  {link.name:16} {link.describe()}", flush=True)
    for door in served_doors(served(placed)):
        print(f"  socket   {door.line}", flush=True)
    if arguments.gateway:
        print(f"the gateway is here; the vessel needs: {vessel_words(placed)}", flush=True)
    gateway = shore_gateway(placed, arguments.instance, run_dir) if arguments.gateway else None
    for place in places(gateway.settings.endpoints) if gateway else ():
        print(f"  {place}", flush=True)
    for door in gateway_doors(gateway.settings) if gateway else ():
        print(f"  socket   {door.line}", flush=True)
    never_waiting()
    clock = SystemClock(float(arguments.speed))
    with (run_dir / "board.csv").open("w", encoding="utf-8") as pins:
        world: LoopApp = WorldOnly(surroundings, pins)
        if gateway is not None:
            world = WithGateway(world, gateway)
        return run(world, clock, stop, period_us=settings.system.period_us, until_us=until_us)


def _greet(world: World, run_dir: Path, speed: float | None, gateway: Gateway | None) -> None:
    settings = world.settings
    print(f"simulated vessel '{settings.system.name}', system id {settings.system.system_id}; recording in {run_dir}")
    if speed is not None:
        for place in places(settings.endpoints):
            print(f"  {place}")
        if settings.radio.url:
            print(f"  radio    {run_dir}/lora  (serial port of the shore modem, {settings.radio.protocol})")
            if gateway is not None:
                print("           its shore side, the gateway, is here; stations of the far side:")
                for place in places(gateway.settings.endpoints):
                    print(f"  {place}")
            elif settings.radio.protocol == "compact":
                print(
                    "           the shore side of a compact link is 'companion gateway', or 'companion sim --gateway'"
                )
        doors = [*served_doors(served(settings)), *vessel_doors(settings)]
        for door in doors + ([] if gateway is None else gateway_doors(gateway.settings)):
            print(f"  socket   {door.line}")
        if speed > STATION_SPEED and settings.operator.gcs_required:
            silence_s = settings.failsafe.gcs_timeout_s
            print(f"  time runs {speed:g} times as fast: a ground station counts as lost after {silence_s:.0f} s of it")
        print("  Ctrl-C ends it, neutral first")
    sys.stdout.flush()


def _farewell(world: World, wall_s: float, run_dir: Path) -> None:
    """The last line. A run that is not whole on the disk is not called one to see: what is missing is said next."""
    duration_s = world.now_us * 1e-6
    look = "" if world.not_recorded() else f"; see it: companion report {run_dir}"
    print(f"{duration_s:.0f} s simulated in {wall_s:.1f} s, {world.metrics.distance_m:.0f} m sailed{look}", flush=True)
