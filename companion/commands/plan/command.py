"""``companion plan``: make, check, convert, upload, download, start, pause and clear plans.

Files: QGroundControl .plan and .mission, QGC WPL 110, fence lists, the seed's JSON; told apart by their contents. What goes to the vessel
goes through MAVSDK (``companion.commands.plan.link``), so it is the way that a user's own MAVSDK program would take.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.figures import FIGURES, Circle, LoiterDirection, figure_of
from mavlink_bridge.language.messages import Goto, Loiter
from mavlink_bridge.mavlink.missions.plan_export import InexpressibleError, items_from_maneuvers
from mavlink_bridge.mavlink.missions.plan_rules import DEFAULT_LIMITS, PlanLimits
from mavlink_bridge.plans import PlanFile, PlanFileError, read_plan, seed_json

from ...core.hull.statics import top_speed_mps
from ...core.vehicle.plan_reach import MissionConfig
from ...io.whole_file import write_whole
from ...settings import ConfigError, Settings, load, load_vessel
from ...settings.device import no_device
from ..numbers import number, positive
from ..outputs import may_write
from . import find, link as plan_link
from .draw import ascii_map, svg_map
from .explain import explain, far_legs, refusals
from .json import send_json
from .leaving import HOLDS, SAILS, leave
from .log import params_in, plan_in
from .save import check_ending, save
from .water import ChartedWater, water_of

_OF_A_LOITER: Final = ("kind", "radius", "length", "bearing", "duration", "ccw")
_FAR_HELP: Final = "accept that this one plan lies far away or has long legs"
_DECIMAL_COMMA: Final = re.compile(r"-?\d+,-?\d+(,-?\d+)*")
"""Whole numbers and commas alone: nobody means a place to the degree."""


def register(subparsers: Any) -> None:
    """Add the command and its own sub-commands."""
    parser = subparsers.add_parser("plan", help="make, check, upload, download and start plans", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    _register_files(actions)
    _register_vessel(actions)


def _register_files(actions: Any) -> None:
    check = add_action(actions, "check", _check, "draw a plan and list what the vessel would refuse and why")
    check.add_argument("file", type=Path)
    check.add_argument("--config", type=Path, help="the vessel's configuration, for its limits")
    check.add_argument("--svg", type=Path, metavar="OUT", help="draw into an SVG file as well")
    convert = add_action(
        actions, "convert", _convert, "read a plan file of any format, write .plan, .txt (WPL 110) or .json"
    )
    convert.add_argument("file", type=Path)
    convert.add_argument("out", type=Path)
    extract = add_action(
        actions, "extract", _extract, "take the plans, or the parameters, out of a telemetry log or a run"
    )
    extract.add_argument("file", type=Path, metavar="F.tlog|RUN_DIR")
    extract.add_argument("out", type=Path, help="a plan file; or F.params for the vehicle's parameters")
    make = add_action(actions, "make", _make, "write a plan of waypoints or one loiter")
    make.add_argument("out", type=Path)
    make._negative_number_matcher = re.compile(r"-[\d.]")  # argparse takes -41.5,8.7 for an option
    make.add_argument("points", nargs="+", metavar="LAT,LON", type=_point, help="two or more: a route; one: a loiter")
    make.add_argument("--kind", choices=list(FIGURES), help="of a loiter; circular")
    make.add_argument("--radius", type=positive, metavar="M")
    make.add_argument("--length", type=positive, metavar="M")
    make.add_argument("--bearing", type=number(), metavar="DEG", help="long axis, from north")
    make.add_argument("--duration", type=positive, metavar="S", help="from reaching the path; without: for ever")
    make.add_argument("--ccw", action="store_true", help="turn to port")
    make.add_argument("--far", action="store_true", help="legs may be longer than the vessel sails without being asked")
    make.add_argument("--speed", type=positive, metavar="M/S")
    send = add_action(actions, "send-json", _send_json, "send the seed's JSON plan through a radio modem's port")
    send.add_argument("file", type=Path)
    send.add_argument("port", help="device, or an address such as serial:/dev/ttyUSB0?baud=9600")
    send.add_argument("--wait", type=positive, default=60.0, metavar="S", help="how long to wait for the answer")


def _register_vessel(actions: Any) -> None:
    upload = vessel_action(
        actions, "upload", _upload, "send mission, fence and rally points to the vessel", _read_upload
    )
    upload.add_argument("file", type=Path)
    upload.add_argument("--start", action="store_true", help="arm and start it afterwards")
    upload.add_argument("--far", action="store_true", help=_FAR_HELP)
    upload.add_argument("--watch", action="store_true", help="stay until it has been sailed")
    download = vessel_action(
        actions, "download", _download, "fetch what the vessel has into a .plan or .txt file", _check_download
    )
    download.add_argument("out", type=Path)
    start = vessel_action(actions, "start", _start, "arm and start the plan")
    start.add_argument("--no-arm", action="store_true")
    start.add_argument("--far", action="store_true", help=_FAR_HELP)
    start.add_argument("--watch", action="store_true", help="stay until it has been sailed")
    vessel_action(actions, "pause", _pause, "hold here; 'start --no-arm' goes on")
    vessel_action(actions, "disarm", _disarm, "no more thrust: the boat drifts")
    clear = vessel_action(actions, "clear", _clear, "empty the vessel's plans")
    clear.add_argument("--keep-fence", action="store_true")


def add_action(actions: Any, name: str, run: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(name, help=text, description=text)
    parser.set_defaults(run=run)
    return parser


def vessel_action(
    actions: Any,
    name: str,
    run: Callable[[Any, argparse.Namespace], None],
    text: str,
    first: Callable[[argparse.Namespace], None] = lambda arguments: None,
) -> argparse.ArgumentParser:
    """An action that talks to the vessel. ``first`` judges the arguments before anything is opened."""

    def command(arguments: argparse.Namespace) -> int:
        first(arguments)
        urls = [arguments.url] if arguments.url else find.places(arguments.config, arguments.host)
        return plan_link.with_vessel(urls, arguments.wait, lambda vessel: run(vessel, arguments))

    parser = add_action(actions, name, command, text)
    parser.add_argument(
        "--config", type=Path, metavar="F", help="the boat's or gateway's TOML file: its endpoints are tried"
    )
    parser.add_argument("--host", default="127.0.0.1", help="the boat's computer (default: this one)")
    parser.add_argument("--url", help=f"one MAVSDK connection (default: {', '.join(find.USUAL)}, in turn)")
    parser.add_argument("--wait", type=positive, default=30.0, metavar="S", help="how long to look for the vessel")
    return parser


def _point(text: str) -> tuple[float, float]:
    if _DECIMAL_COMMA.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"{text!r}: is this a decimal comma? Give LAT,LON with decimal points, as in 41.18,-8.70; for whole degrees 41.0,-8.0"
        )
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: give latitude,longitude in degrees") from None
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise argparse.ArgumentTypeError(f"{text!r}: outside -90 to 90 and -180 to 180")
    return math.radians(latitude), math.radians(longitude)


# Files


def read_file(path: Path) -> PlanFile:
    """Read a plan file. Raises ConfigError with every problem, so that the command ends with status 2."""
    try:
        return read_plan(no_device(path).read_bytes(), path.name)
    except OSError as error:
        raise ConfigError(str(path), [error.strerror or str(error)]) from None
    except PlanFileError as error:
        raise ConfigError(str(path), list(error.problems)) from None


def _settings(config: Path | None) -> Settings:
    return load(config, [], Settings)


def _limits(config: Path | None) -> PlanLimits:
    if config is None:
        return DEFAULT_LIMITS
    settings = _settings(config)
    return PlanLimits(max_speed_mps=top_speed_mps(load_vessel(settings.vessel)))


def _check(arguments: argparse.Namespace) -> int:
    may_write(arguments.svg, arguments.file, arguments.config)
    plan = read_file(arguments.file)
    limits = _limits(arguments.config)
    print(
        f"{arguments.file}: {plan.format}, {len(plan.mission)} items, fence {len(plan.fence)}, rally {len(plan.rally)}"
    )
    for note in plan.notes:
        print(f"  note: {note}")
    water = ChartedWater() if arguments.config is None else water_of(plan, _settings(arguments.config))
    print(ascii_map(plan, water.unknown_rad))
    for line in explain(plan, limits):
        print(line)
    for line in water.told:
        print(line)
    refused = [*refusals(plan, limits), *water.refused]
    for line in refused:
        print(f"REFUSED {line}", file=sys.stderr)
    for line in far_legs(plan, _settings(arguments.config).mission):
        print(f"WARNING {line}; 'companion plan start --far' accepts it", file=sys.stderr)
    if arguments.svg is not None:
        write_whole(arguments.svg, svg_map(plan, water.unknown_rad).encode("utf-8"))
    return 1 if refused else 0


def _convert(arguments: argparse.Namespace) -> int:
    check_ending(arguments.out)
    may_write(arguments.out, arguments.file)
    plan = read_file(arguments.file)
    save(plan, arguments.out)
    return 0


def _extract(arguments: argparse.Namespace) -> int:
    source: Path = arguments.file
    wants_params = arguments.out.suffix == ".params"
    if not wants_params:
        check_ending(arguments.out)
    may_write(arguments.out, source)
    try:
        found = params_in(source) if wants_params else plan_in(source)
    except OSError as error:
        raise ConfigError(str(source), [error.strerror or str(error)]) from None
    if isinstance(found, str):
        return _write_params(found, source, arguments.out)
    if not (found.mission or found.fence or found.rally):
        print(f"{source}: no complete plan was transferred in this log", file=sys.stderr)
        return 1
    save(found, arguments.out)
    return 0


def _write_params(text: str, source: Path, out: Path) -> int:
    if not text:
        print(
            f"{source}: no vehicle told its parameters in this log, and no station fetched them whole", file=sys.stderr
        )
        return 1
    write_whole(out, text.encode("utf-8"))
    print(f"{out}: {text.count(chr(10)) - 1} parameters")
    return 0


def _make(arguments: argparse.Namespace) -> int:
    points, speed = arguments.points, arguments.speed
    check_ending(arguments.out)
    may_write(arguments.out)
    strange = [
        f"--{name}: is for a loiter; leave it out, or give one point"
        for name in _OF_A_LOITER
        if getattr(arguments, name)
    ]
    if len(points) > 1 and strange:
        raise ConfigError("plan make", strange)
    if len(points) > 1:
        maneuvers: list[Any] = [Goto(seq, lat, lon, speed_mps=speed) for seq, (lat, lon) in enumerate(points)]
    else:
        maneuvers = [_loiter(arguments, points[0])]
    try:
        plan = PlanFile(items_from_maneuvers(maneuvers))
    except InexpressibleError as error:
        raise ConfigError("plan make", [str(error)]) from None
    refused = refusals(plan, DEFAULT_LIMITS)
    if not arguments.far:
        refused += [f"{leg}; --far writes it all the same" for leg in far_legs(plan, MissionConfig())]
    if refused:
        raise ConfigError("plan make", refused)
    save(plan, arguments.out)
    return 0


def _loiter(arguments: argparse.Namespace, point: tuple[float, float]) -> Loiter:
    return Loiter(
        0,
        *point,
        figure=figure_of(
            arguments.kind or Circle.name,
            radius_m=arguments.radius or 20.0,
            length_m=arguments.length,
            bearing_rad=None if arguments.bearing is None else math.radians(arguments.bearing % 360.0),
            direction=LoiterDirection.CCW if arguments.ccw else LoiterDirection.CW,
        ),
        duration_s=arguments.duration,
        speed_mps=arguments.speed,
    )


def _send_json(arguments: argparse.Namespace) -> int:
    try:
        data = no_device(arguments.file).read_bytes()
        seed_json.parse(data)
    except OSError as error:
        raise ConfigError(str(arguments.file), [error.strerror or str(error)]) from None
    except seed_json.SeedJsonError as error:
        raise ConfigError(str(arguments.file), [str(error)]) from None
    return send_json(data, arguments.port, arguments.wait)


# The vessel


def _read_upload(arguments: argparse.Namespace) -> None:
    arguments.plan = read_file(arguments.file)


def _upload(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    vessel.upload(arguments.plan)
    if arguments.start or arguments.watch:
        _go(vessel, arm=True, far=arguments.far, watch=arguments.watch)


def _check_download(arguments: argparse.Namespace) -> None:
    check_ending(arguments.out)
    may_write(arguments.out, arguments.config)


def _download(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    plan = vessel.download()
    save(plan, arguments.out)


def _start(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    _go(vessel, arm=not arguments.no_arm, far=arguments.far, watch=arguments.watch)


def _go(vessel: plan_link.Vessel, *, arm: bool, far: bool, watch: bool) -> None:
    if far:
        vessel.accept_far()
    vessel.start(arm=arm)
    if watch:
        vessel.watch()
        leave(vessel, HOLDS)
    else:
        leave(vessel, SAILS, "--watch stays connected")


def _pause(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    vessel.pause()
    leave(vessel, HOLDS)


def _disarm(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    vessel.disarm()
    vessel.hand_over()


def _clear(vessel: plan_link.Vessel, arguments: argparse.Namespace) -> None:
    vessel.clear(fence=not arguments.keep_fence)
