"""``companion web``: the page on the boat, for a telephone on the pier. A process of its own; the vessel sails without it."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import errno
import gzip
import json
import logging
import os
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from ..commands.log_lines import never_waiting
from ..doors import page_door
from ..settings import Settings, load
from ..status.client import places
from ..worlds import STORE_NAME
from .depths import Depths
from .http import HttpAnswer, HttpRequest
from .page import Page, build, file_answer
from .runs import Runs
from .server import Handler, PageServer, orders
from .vessel import VesselLink

DEPTHS_S: Final = 30.0
"""Between two looks into the store."""
DEPTHS_SHARE: Final = 0.05
"""Of the time at most goes into looking: a large store is looked into less often."""
_OF_THE_PORT: Final = (errno.EADDRINUSE, errno.EACCES)
"""What a computer says of a port that another listens on, or that is kept for root; anything else is the address's."""
log = logging.getLogger(__name__)


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("web", help="the page on the boat, for a telephone", description=__doc__)
    parser.add_argument("config", type=Path, help="the vessel's TOML file; its [page] says where and with which key")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument(
        "--vessel", type=Path, metavar="RUN_DIR|SOCKET", help="where the vessel serves (default: as the file says)"
    )
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Serve until SIGINT or SIGTERM."""
    settings = load(arguments.config, arguments.set, Settings)
    found = places(arguments.vessel or arguments.config)
    never_waiting()
    try:
        asyncio.run(serve(settings, found))
    except OSError as error:
        raise OSError(error.errno, _not_served(settings, error)) from None
    return 0


def _not_served(settings: Settings, error: OSError) -> str:
    """Why nothing is served, and which key mends it. Who looks up names counts his reasons by himself, and says them in words."""
    bind, port = settings.page.bind, settings.page.port
    reason = error.strerror or str(error)
    if error.errno and not isinstance(error, socket.gaierror):
        reason = os.strerror(error.errno)
    if error.errno in _OF_THE_PORT:
        return f"page.port = {port}: cannot serve at {bind}: {reason}; choose another page.port"
    return f"page.bind = {bind!r}: cannot serve there: {reason}; give an address of this computer, or 0.0.0.0 for all"


async def serve(settings: Settings, found: list[Path], ready: Callable[[int], None] = lambda port: None) -> None:
    """Serve the page of the vessel at one of these sockets until a signal comes."""
    vessel = VesselLink(found)
    depths = DepthsBeside(Depths(settings, _store(settings, found)), vessel)
    runs = Runs(Path(settings.record.directory))
    page = build()
    server = PageServer(
        vessel, _routes(vessel, page, depths, runs), lambda name: _download(runs, name), settings.page.names
    )
    port = await server.start(settings.page.bind, settings.page.port)
    door = page_door(settings, port)
    log.info("page: http://%s:%d/", settings.page.bind, port)
    log.info("socket: %s", door.line)
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    ready(port)
    tasks = [asyncio.create_task(vessel.run()), asyncio.create_task(depths.run())]
    try:
        await stop.wait()
    finally:
        for task in tasks:
            task.cancel()
        await server.close()
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.gather(*tasks, return_exceptions=True)


def _store(settings: Settings, found: list[Path]) -> Path | None:
    """The vessel's store: where the file says, else beside the socket of a vessel that was named."""
    beside = [path.with_name(Path(settings.store or STORE_NAME).name) for path in found]
    return next((path for path in beside if path.is_file()), None)


class DepthsBeside:
    """The newest depth map, looked up in a thread of its own so that no request waits for a disk."""

    def __init__(self, depths: Depths, vessel: VesselLink) -> None:
        self._depths = depths
        self._vessel = vessel
        self.found: dict[str, Any] = {}

    async def run(self) -> None:
        """Look now and then; ends when it is cancelled."""
        while True:
            picture = self._vessel.picture or {}
            lat, lon = picture.get("lat_deg"), picture.get("lon_deg")
            if lat is None or lon is None:
                await asyncio.sleep(1.0)
                continue
            began_s = time.monotonic()
            try:
                self.found = await asyncio.to_thread(self._depths.around, lat, lon)
            except Exception:
                log.exception("the depth map could not be read")
            await asyncio.sleep(max(DEPTHS_S, (time.monotonic() - began_s) / DEPTHS_SHARE))


def _routes(vessel: VesselLink, page: Page, depths: DepthsBeside, runs: Runs) -> dict[tuple[str, str], Handler]:
    async def document(request: HttpRequest, body: bytes) -> HttpAnswer:
        return page.answer(request.headers.get("accept-encoding", ""))

    async def chart(request: HttpRequest, body: bytes) -> HttpAnswer:
        return _packed({"track": vessel.track.fields(), "drawing": vessel.drawing}, request)

    async def bottom(request: HttpRequest, body: bytes) -> HttpAnswer:
        return _packed(depths.found, request)

    async def listed(request: HttpRequest, body: bytes) -> HttpAnswer:
        return _packed(await asyncio.to_thread(runs.listed), request)

    return {
        ("GET", "/"): document,
        ("GET", "/map"): chart,
        ("GET", "/depths"): bottom,
        ("GET", "/runs"): listed,
        **orders(vessel),
    }


def _packed(data: Any, request: HttpRequest) -> HttpAnswer:
    body = json.dumps(data, separators=(",", ":")).encode()
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return HttpAnswer(kind="application/json", body=body)
    headers = {"Content-Encoding": "gzip"}
    return HttpAnswer(kind="application/json", body=gzip.compress(body, 6, mtime=0), headers=headers)


def _download(runs: Runs, name: str) -> tuple[int, int, HttpAnswer] | None:
    run, _, file = name.partition("/")
    found = runs.open(run, file)
    return None if found is None else (*found, file_answer(file))
