"""``companion check``: explain and validate a configuration; opens nothing, except the sensors with ``--live``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ...configuration import depth_map, mistakes_of, vessel_settings
from ...core.hull.geometry import mounted, strangers
from ...core.hull.statics import stopping_distance_m, top_speed_mps
from ...doors import page_door, vessel_doors
from ...judge import verdict, vessel_notes, vessel_warnings
from ...radio import load_radio, read_key, stops_of
from ...settings import load_vessel
from ...settings.reading import with_lines
from ..numbers import positive
from ..plan.water import chart_warnings, grid_words
from .live_data import watch
from .steering import heading_loop, seed_warnings
from .store import store_lines
from .voyages import voyages_fit


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("check", help="explain and validate a configuration", description=__doc__)
    parser.add_argument("config", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument(
        "--live",
        nargs="?",
        type=positive,
        const=5.0,
        metavar="SECONDS",
        help="listen to the sensors (5 s) and say what comes",
    )
    parser.add_argument(
        "--voyage",
        nargs="+",
        type=Path,
        default=[],
        metavar="RUN_DIR|F.csv",
        help="hold the hull's file against these voyages: fouling, load, a propeller that gives less",
    )
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Print what the configuration means, or every mistake (exit 2)."""
    from . import gateway as check_gateway

    if check_gateway.is_gateway(arguments.config):
        return check_gateway.check(arguments.config, arguments.set)
    settings = vessel_settings(arguments.config, arguments.set)
    radio = settings.radio
    vessel = load_vessel(settings.vessel)
    warnings, store = vessel_warnings(settings), list(store_lines(settings))
    of_store = [text for what, text in store if what == "WARNING"]
    grid = depth_map(settings.depth.map) if settings.depth.enabled else None
    warnings += chart_warnings(grid)
    unused = strangers(vessel, [sensor.name for sensor in settings.sensors])
    of_loop = seed_warnings(settings.steering, vessel)
    print(f"{arguments.config}: {verdict([*warnings, *of_store, *of_loop, *unused])}")
    print(f"  vessel      {settings.system.name} (system id {settings.system.system_id}), hull '{vessel.name}'")
    print(f"  speed       top {top_speed_mps(vessel):.1f} m/s, cruise {settings.mission.cruise_speed_mps:.1f} m/s")
    print("\n".join([*heading_loop(settings.steering, vessel), *(f"  WARNING     {text}" for text in of_loop)]))
    print(f"  stopping    {stopping_distance_m(vessel, settings.mission.cruise_speed_mps):.1f} m from cruise speed")
    print(f"  keel        {vessel.keel_depth_m:g} m below the waterline (hull file)")
    for sensor in settings.sensors:
        print(f"  sensor      {sensor.name}: {sensor.url}{mounted(vessel, sensor.name)}")
    for name in unused:
        print(f"  NOT USED    hull file: mounts.{name}: no sensor has this name")
    print(f"  actuators   {settings.actuators.url or 'none: the vessel cannot be armed'}")
    for endpoint in settings.endpoints:
        print(f"  endpoint    {endpoint.name}: {endpoint.url}, {endpoint.persona}, {endpoint.link_class}")
    print(f"  radio       {f'{radio.url}, {radio.protocol}, profile {radio.profile}' if radio.url else 'none'}")
    if radio.url and radio.protocol == "compact":
        print(f"  stops       {stops_of(load_radio(radio.profile))}")
        for problem in mistakes_of(lambda: read_key(radio.key_file)):
            print(f"  NOT YET     {problem}")
    key = settings.security.key_file
    print(f"  signing     {f'key in {key}' if key else 'no key: nothing is signed'}")
    for door in vessel_doors(settings):
        print(f"  socket      {door.line}")
    print(f"  page        only while 'companion web' runs: {page_door(settings).line}")
    for note in with_lines(arguments.config, vessel_notes(settings)):
        print(f"  NOTE        {note}")
    for warning in with_lines(arguments.config, warnings):
        print(f"  WARNING     {warning}")
    depth = settings.depth
    print(f"  depth guard {f'{depth.min_altitude_m:g} m under the keel' if depth.enabled else 'off'}")
    if grid is not None:
        print(f"  chart       {depth.map.file}: {grid_words(grid)}")
    for what, text in store:
        print(f"  {what:11} {text}")
    fits = voyages_fit(arguments.voyage, vessel) if arguments.voyage else True
    heard = arguments.live is None or watch(settings, arguments.live)
    return 0 if fits and heard else 1
