"""Begins to serve watchers for an app: the socket, the page's key, the drawing. A vessel without it sails all the same."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mavlink_bridge.language.messages import Severity

from ..app import App
from ..io.keeping.keys import read_key
from ..io.local_socket import LocalServer
from .client import socket_of
from .drawing import drawing
from .orders import Challenges
from .service import StatusService

log = logging.getLogger(__name__)


def serve(
    app: App,
    run_dir: Path,
    *,
    say: Callable[[Severity, str], None],
    airtime_fn: Callable[[int], str] = lambda now_us: "",
    speed: float = 1.0,
) -> StatusService | None:
    """Serve the app's status; None, and a warning in the log, when the socket cannot be had.

    ``say``: how a text reaches the operators and the recording. Raises KeyFileError for a page's key that cannot be used.
    """
    settings = app.settings
    path = socket_of(settings.store, run_dir)
    key = read_key(Path(settings.page.key_file)) if settings.page.key_file else None
    challenges = Challenges(key, app.store.snapshot().vessel or secrets.token_hex(16), secrets.token_bytes)
    try:
        assert path is not None
        server = LocalServer(path)
    except OSError as error:
        log.warning("no status socket, 'companion status' and the page see nothing: %s: %s", path, error.strerror)
        return None
    log.info("status socket: %s", path)
    return StatusService(
        server,
        app,
        challenges,
        name=settings.system.name,
        drawing_fn=lambda: _drawing(app),
        airtime_fn=airtime_fn,
        say=say,
        speed=speed,
    )


def _drawing(app: App) -> dict[str, Any]:
    mission, fence = app.facade.plans.ids[:2]
    parts = app.vehicle.parts
    radius_m = app.settings.guidance.loiter_radius_m
    return drawing(parts.mission.plan, parts.fence.areas, radius_m, ids=(mission, fence))
