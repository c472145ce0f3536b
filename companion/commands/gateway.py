"""``companion gateway``: the shore side of the LoRa link, between the modem's serial port and ground stations."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import Any

from ..configuration import gateway_settings, own_store
from ..doors import gateway_doors
from ..gateway import PERIOD_US, Gateway, GatewaySettings
from ..io.clock import SystemClock
from ..io.keeping import AnyStore, MemoryStore, Store
from ..io.loop import StopFlag, run
from ..judge import gateway_warnings
from .log_lines import never_waiting
from .numbers import positive
from .stations import places
from .status import Journal

log = logging.getLogger(__name__)


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("gateway", help="the shore side of the LoRa link", description=__doc__)
    parser.add_argument("config", type=Path, help="TOML file; config/gateway.toml is a commented example")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument("--duration", type=positive, metavar="S", help="end after so many seconds")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Run until a signal ends it."""
    settings = gateway_settings(arguments.config, arguments.set, to_serve=True)
    with own_store(arguments.config, settings.store):
        return _serve(arguments, settings)


def _serve(arguments: argparse.Namespace, settings: GatewaySettings) -> int:
    never_waiting()
    store: AnyStore = Store(Path(settings.store)) if settings.store else MemoryStore()
    for warning in store.warnings:
        log.warning("%s", warning)
    clock = SystemClock()
    gateway = Gateway(settings, store=store, started_utc_us=clock.utc_us() or 0)
    profile = gateway.profile
    label = settings.entity_label or profile.entity_label or settings.name
    log.info("%s: gateway on %s, %s, %s", label, settings.url, profile.title, profile.band_rule.title)
    for place in places(settings.endpoints):
        log.info("stations: %s", place)
    for warning in gateway_warnings(settings):
        log.warning("%s", warning)
    for door in gateway_doors(settings):
        log.info("socket: %s", door.line)
    gateway.view = Journal().update
    stop = StopFlag().install()
    until_us = None if arguments.duration is None else clock.now_us() + round(arguments.duration * 1e6)
    return run(gateway, clock, stop, period_us=PERIOD_US, until_us=until_us)
