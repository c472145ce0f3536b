"""A rehearsal at the boat's own site: where the simulated vessel starts, and over which bottom."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from companion.commands.numbers import positive
from companion.configuration import depth_map
from companion.io.keeping import AnyStore
from companion.worlds import STORE_NAME, copied, simulated_content, simulated_store

from .world import SimSettings


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what a rehearsal needs to ``companion sim``."""
    parser.add_argument(
        "--at", nargs=2, type=_degrees, metavar=("LAT", "LON"), help="where the vessel starts, decimal degrees"
    )
    parser.add_argument(
        "--water",
        type=positive,
        metavar="M",
        help="depth of the water, m; where depth.map.file knows it, that chart is the bottom",
    )
    parser.add_argument(
        "--copy-store", action="store_true", help="start with a copy of the parameters and plans of the boat's store"
    )
    parser.add_argument(
        "--store", type=Path, metavar="F", help="the simulation's own store, kept from run to run (default: RUN_DIR's)"
    )


def _degrees(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: decimal degrees with a point, e.g. --at 41.1850 -8.7062") from None


def mistakes(settings: SimSettings, arguments: argparse.Namespace) -> list[str]:
    """What of the place and its water cannot be meant."""
    kept = [item for item in arguments.set if item.partition("=")[0].strip() == "store" and item.partition("=")[2]]
    if kept:
        return [f"--set {kept[0]}: a simulation does not open the boat's store; --store F keeps one of its own"]
    if arguments.at is None:
        return []
    lat_deg, lon_deg = arguments.at
    if abs(lat_deg) > 89.0 or abs(lon_deg) > 180.0:
        return [f"--at {lat_deg:g} {lon_deg:g}: latitude -89...89, then longitude -180...180"]
    if arguments.water is not None or _bottom_is_given(arguments.set):
        return []
    chart = depth_map(settings.depth.map)
    if chart is None:
        return ["--at: which depth? --water M, or a chart as depth.map.file"]
    if chart.depth_at(math.radians(lat_deg), math.radians(lon_deg)) is None:
        return [f"--at {lat_deg:g} {lon_deg:g}: {settings.depth.map.file} knows no depth there; --water M gives one"]
    return []


def placed(settings: SimSettings, arguments: argparse.Namespace) -> SimSettings:
    """Settings with the vessel at its place, over the owner's chart where there is one."""
    world = settings.world
    if arguments.at is not None:
        world = world.model_copy(update={"latitude_deg": arguments.at[0], "longitude_deg": arguments.at[1]})
    if (arguments.at is not None or arguments.water is not None) and not _bottom_is_given(arguments.set):
        kind = "flat" if settings.depth.map.file is None else "chart"
        depth_m = world.bottom.depth_m if arguments.water is None else arguments.water
        bottom = world.bottom.model_copy(
            update={"kind": kind, "depth_m": depth_m, "beyond": arguments.water is not None}
        )
        world = world.model_copy(update={"bottom": bottom})
    return settings.model_copy(update={"world": world})


def _bottom_is_given(overrides: Sequence[str]) -> bool:
    return any(item.strip().startswith("world.bottom.") for item in overrides)


def store_of(boat: SimSettings, arguments: argparse.Namespace, run_dir: Path, *, in_memory: bool) -> AnyStore:
    """The simulation's store: its own file, one beside the run, or (in lock-step) memory. ``boat``: settings as the file has them."""
    content = simulated_content(arguments.seed, copied(boat) if arguments.copy_store else None)
    path = arguments.store or (None if in_memory else run_dir / STORE_NAME)
    return simulated_store(path, content)
