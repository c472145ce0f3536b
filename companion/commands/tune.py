"""``companion tune``: check and design gains with python-control, from the same vessel file that the boat sails by."""

from __future__ import annotations

import argparse
import importlib.util
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..core.hull import VesselConfig
from ..core.steer import SteeringConfig
from ..core.steer.pid import PidGains
from ..io.whole_file import write_whole
from ..settings import ConfigError, explain, load_vessel
from ..settings.device import no_device
from ..settings.schema import unreadable
from . import MissingExtraError, install_line, tune_vessel
from .numbers import number
from .outputs import may_write
from .progress import ProgressLine

LEAST_FIT = 0.7
"""Below it K and T are no description of the vessel: a loiter, or a record that the wind made."""
MANOEUVRE = "sail a zig-zag, or say with --span where one is"


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("tune", help="design and check gains", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    _add(actions, "margins", margins, "gain and phase margins over the speed range; status 1 when a bar is missed")
    _add(actions, "nomoto", nomoto, "turning gain and lag over the speed range")
    written = _add(actions, "gains", gains, "find gains for the seed's law by margins, and write them")
    written.add_argument("-o", "--output", type=Path, metavar="F.toml", help="file for the gains; default: print them")
    drawn = _add(actions, "figures", figures, "root locus, Bode and sisotool pictures of the heading loop")
    drawn.add_argument("-o", "--output", type=Path, default=Path("tune"), metavar="DIR")
    drawn.add_argument("--speed", type=number(0.1, 20.0), default=1.5, metavar="MPS")
    tune_vessel.register(actions)
    found = actions.add_parser("identify", help="K and T from a recorded step, turn or zig-zag")
    found.add_argument("record", type=Path, metavar="F.csv|RUN_DIR")
    found.add_argument(
        "--columns", nargs=3, metavar=("TIME", "INPUT", "RATE"), help="names, when they are not known ones"
    )
    found.add_argument("--span", nargs=2, type=number(), metavar=("FROM", "TO"), help="seconds of the record to use")
    found.set_defaults(run=identify_record)


def _add(actions: Any, name: str, function: Any, text: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(name, help=text, description=text)
    parser.add_argument("config", nargs="?", type=Path, metavar="F.toml", help="take vessel and steering from here")
    parser.add_argument(
        "--vessel", default="", help="a shipped vessel or a path; default: the configuration's, or otter"
    )
    parser.add_argument("--profile", choices=("model", "seed"), help="default: the configuration's")
    parser.add_argument("--delay", type=number(0.0, 5.0), default=0.15, metavar="S", help="delay in the loop")
    parser.set_defaults(run=function)
    return parser


def _chosen(arguments: argparse.Namespace) -> tuple[SteeringConfig, VesselConfig, str]:
    """Steering settings, vessel and profile that the arguments name."""
    if importlib.util.find_spec("control") is None:
        raise MissingExtraError(f"tuning needs python-control: {install_line('design')}")
    steering, name = SteeringConfig(), "otter"
    if arguments.config:
        steering, name = _read(arguments.config)
    vessel = load_vessel(arguments.vessel or name)
    return steering, vessel, arguments.profile or ("seed" if steering.profile == "seed" else "model")


def _read(path: Path) -> tuple[SteeringConfig, str]:
    """Take steering and vessel out of a configuration file of any kind (boat or simulation)."""
    try:
        data = tomllib.loads(no_device(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise ConfigError(str(path), [unreadable(error)]) from None
    try:
        return SteeringConfig.model_validate(data.get("steering", {})), str(data.get("vessel", "otter"))
    except ValidationError as error:
        raise ConfigError(str(path), [explain(item) for item in error.errors()]) from None


def margins(arguments: argparse.Namespace) -> int:
    """Print the margins; 0 when all hold."""
    from ..core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
    from ..tuning.margins import heading_margins

    steering, vessel, profile = _chosen(arguments)
    if profile == "seed" and steering.seed.heading_gains is None:
        print(
            "profile 'seed' has no gains: give a configuration with [steering.seed.heading_gains], or see `tune gains`"
        )
        return 2
    print(
        f"{vessel.name}, profile {profile}, delay {arguments.delay} s; bars {GAIN_BAR_DB:g} dB, {PHASE_BAR_DEG:g} deg"
    )
    print(" m/s   gain dB  phase deg     Ms  crossover rad/s")
    holds = True
    for found in heading_margins(steering, vessel, profile, arguments.delay):
        mark = "" if found.holds else "  below the bar"
        print(
            f"{found.speed_mps:4.1f} {found.gain_db:9.1f} {found.phase_deg:10.1f} {found.peak:6.2f} "
            f"{found.crossover_radps:8.2f}{mark}"
        )
        holds = holds and found.holds
    return 0 if holds else 1


def nomoto(arguments: argparse.Namespace) -> int:
    """Print K and T of rudder to yaw rate, and the damping that schedules the feed-forward."""
    from ..core.hull import Handling
    from ..tuning.margins import SPEEDS_MPS
    from ..tuning.plants import nomoto as found, reachable

    _, vessel, _ = _chosen(arguments)
    handling = Handling(vessel)
    print(" m/s    K 1/s     T s   damping Nm s   rudders Nm   thrusters Nm   turn radius m")
    for speed in reachable(vessel, SPEEDS_MPS):
        try:
            shown = "{:8.2f} {:7.2f}".format(*found(vessel, speed))
        except ValueError:
            shown = "       -       -"
        authority = handling.authority(speed)
        print(
            f"{speed:4.1f} {shown} {handling.yaw_damping(speed)[0]:14.1f} {authority.rudder_nm:12.0f} "
            f"{authority.differential_nm:14.0f} {handling.turn_radius_m(speed):15.1f}"
        )
    return 0


def gains(arguments: argparse.Namespace) -> int:
    """Find gains for the seed's law; write or print them."""
    from ..tuning.margins import SPEED_GAINS, as_toml, seed_gains

    may_write(arguments.output, arguments.config, is_own=_are_gains)
    steering, vessel, _ = _chosen(arguments)
    with ProgressLine("gains", None) as shown:
        found = seed_gains(
            steering, vessel, arguments.delay, told=lambda done, total: shown.count(done, total, "tried")
        )
    if found is None:
        print(f"no gains on the grid hold the margins for {vessel.name} at {arguments.delay} s")
        return 1
    note = f"seed law on {vessel.name}: 8 dB and 45 deg at {arguments.delay} s delay, found by companion tune gains"
    text = as_toml(found, steering.seed.speed_gains or SPEED_GAINS, note)
    if arguments.output:
        write_whole(arguments.output, text.encode("utf-8"))
        print(arguments.output)
    else:
        print(text)
    return 0


def _are_gains(tables: Mapping[str, Any]) -> bool:
    """Whether a file holds what ``gains`` writes, and nothing else."""
    steering = tables.get("steering")
    return tables.keys() == {"steering"} and isinstance(steering, dict) and steering.keys() == {"seed"}


def figures(arguments: argparse.Namespace) -> int:
    """Draw the loop at one speed."""
    from ..tuning.figures import draw
    from ..tuning.margins import model_loop, seed_loop

    steering, vessel, profile = _chosen(arguments)
    if profile == "seed":
        loop = seed_loop(steering, vessel, arguments.speed, steering.seed.heading_gains or PidGains(kp=1.8, kd=0.4))
    else:
        loop = model_loop(steering, vessel, arguments.speed)
    title = f"{vessel.name}, {profile}, {arguments.speed:g} m/s, {arguments.delay:g} s of delay"
    with ProgressLine("drawing", None) as shown:
        made = draw(
            loop,
            arguments.output,
            title,
            arguments.delay,
            told=lambda done, total: shown.count(done, total, "pictures"),
        )
    print(*made, sep="\n")
    return 0


def identify_record(arguments: argparse.Namespace) -> int:
    """Print K and T of a record."""
    if importlib.util.find_spec("numpy") is None:
        raise MissingExtraError(f"identification needs numpy: {install_line('design')}")
    from ..tuning.identify import identify, read_columns

    try:
        record = read_columns(arguments.record, arguments.columns)
    except (OSError, ValueError) as error:
        raise ConfigError(str(arguments.record), [getattr(error, "strerror", None) or str(error)]) from None
    if arguments.span:
        record = record.between(*arguments.span)
    try:
        found = identify(record.times_s, record.inputs, record.rates)
    except ValueError as error:
        print(f"{arguments.record}: {error}; {MANOEUVRE}", file=sys.stderr)
        return 1
    unit = record.unit if record.unit.startswith("of") else f"per {record.unit}"
    print(
        f"K = {found.gain:.3f} rad/s {unit}, T = {found.lag_s:.2f} s, delay {found.delay_s:.2f} s, bias {found.bias:+.4f} rad/s2"
    )
    print(f"fit {100 * found.fit:.0f} %")
    if found.fit < LEAST_FIT:
        print(f"{arguments.record}: no usable manoeuvre; {MANOEUVRE}", file=sys.stderr)
        return 1
    return 0
