"""``companion imc``: the bridge between IMC consoles (Neptus) and a MAVLink vehicle, and the files that a console needs."""

from __future__ import annotations

import argparse
import logging
import os
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import config as shipped

from ...imc.settings import ImcSettings, as_otter, mistakes
from ...io.clock import SystemClock
from ...io.imc_sockets import ImcSockets
from ...settings.reading import read_model
from ..log_lines import never_waiting
from ..numbers import positive, whole

if TYPE_CHECKING:
    from mavlink_bridge.imc import Node

log = logging.getLogger(__name__)

FILES: Final = "neptus-files"
_PIECES: Final = (
    "mavlink_bridge.language.requests",
    "mavlink_bridge.mavlink.client",
    "companion.core.estimate",
    "companion.core.guard.failsafe",
    "companion.core.guide",
    "companion.core.vehicle",
    "companion.logs",
    "companion.core.nmea",
    "companion.facade",
    "companion.imc.desk",
    "mavlink_bridge.mavlink.endpoint",
    "companion.radio",
    "companion.imc.compose",
)
"""The rest of the program takes as long to read as what announces it; none of these takes a tenth of a second after the one before."""
_AS_OTTER: Final = "goes by the name and id of LSTS' own otter: a console needs no files, and cannot tell the two apart"


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("imc", help="show and command the vessel in Neptus, over IMC", description=__doc__)
    parser.add_argument(
        "config", nargs="?", default="", metavar="F.toml", help=f"settings (else config/imc.toml), or the word {FILES}"
    )
    parser.add_argument(
        "folder", nargs="?", type=Path, metavar="DIR", help=f"of {FILES}: the console's folder, or another to copy from"
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument(
        "--as", dest="persona", choices=("otter",), help="go by the name of a vessel that every console knows"
    )
    parser.add_argument("--duration", type=positive, metavar="S", help="end after so many seconds")
    parser.add_argument(
        "--beside",
        type=whole(1),
        metavar="PID",
        help="end with the process PID that started this, even when it is killed",
    )
    parser.set_defaults(run=command, fail=parser.error)


def command(arguments: argparse.Namespace) -> int:
    """Run until a signal ends it, or write the console's files."""
    if arguments.config == FILES:
        return _write_files(arguments)
    if arguments.folder is not None:
        arguments.fail(f"one configuration file; a folder follows only the word {FILES}")
    settings = _settings(arguments, arguments.config)
    never_waiting()
    clock = SystemClock()
    sockets = ImcSockets(settings.listen, settings.udp_port, settings.tcp_port)
    node = _announced(settings, sockets, clock)
    from ...imc.bridge import PERIOD_US
    from ...imc.compose import compose
    from ...io.loop import StopFlag, run

    bridge = compose(settings, node, sockets, clock.utc_us)
    bridge.beside = arguments.beside
    node.open(clock.now_us())
    _greet(settings, sockets)
    if arguments.persona:
        log.warning("%s", _AS_OTTER)
    stop = StopFlag().install()
    until_us = None if arguments.duration is None else clock.now_us() + round(arguments.duration * 1e6)
    return run(bridge, clock, stop, period_us=PERIOD_US, until_us=until_us)


def _announced(settings: ImcSettings, sockets: ImcSockets, clock: SystemClock) -> Node:
    """Say that we are here, then read the rest of the program, and greet between its pieces who is heard meanwhile."""
    from ...imc.announcing import hear, make_node, refresh

    node = make_node(settings, uid=int.from_bytes(os.urandom(6), "big"), opening=True)
    sockets.look()
    refresh(node, sockets, clock.now_us(), clock.utc_us())
    for piece in ("", *_PIECES):
        if piece:
            import_module(piece)
        hear(node, sockets, clock.now_us())
        sockets.send(node.take(clock.now_us()))
    return node


def _settings(arguments: argparse.Namespace, path: str) -> ImcSettings:
    source = Path(path) if path else shipped.path("imc.toml")
    settings = read_model(source, arguments.set, ImcSettings, further=mistakes)
    return as_otter(settings) if arguments.persona else settings


def _greet(settings: ImcSettings, sockets: ImcSockets) -> None:
    log.info("%s (0x%04X) for the vehicle at %s", settings.name, settings.imc_id, settings.vehicle)
    reach = "this computer only" if sockets.is_local else "anybody, unproven (insecure = true)"
    may = "shows, obeys nobody (desk.read_only)" if settings.desk.read_only else "shows and obeys"
    log.info("socket: imc: udp %s:%d; %s; %s", settings.listen, sockets.udp_port, reach, may)
    if sockets.tcp_port:
        log.info("socket: imc: tcp %s:%d; %s; %s", settings.listen, sockets.tcp_port, reach, may)
    log.info("socket: discovery: udp port %d; %s; hears announcements", sockets.finder_port, reach)
    if settings.insecure and not sockets.is_local:
        log.warning("IMC knows no keys: whoever reaches %s can command the vessel (insecure = true)", settings.listen)


def _write_files(arguments: argparse.Namespace) -> int:
    """Write what Neptus needs to know this vessel by its own name."""
    if arguments.folder is None:
        arguments.fail(f"companion imc {FILES} DIR: say which folder")
    from ...imc.compose import vessel_parameters
    from ...imc.neptus import write_files

    settings = _settings(arguments, "")
    for path in write_files(settings, vessel_parameters(settings), arguments.folder):
        print(path)
    print(
        f"Copy them into Neptus' own folders of these names and start it again; then {settings.name} can be chosen there."
    )
    return 0
