"""``companion run``: the real vessel (or a separate process against ``companion sim --world-only``)."""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mavlink_bridge.language.messages import Severity

from ..app import App
from ..build import build_app, in_run_dir
from ..configuration import own_store, vessel_settings
from ..doors import vessel_doors
from ..facade import made_by
from ..io.clock import SystemClock
from ..io.keeping import AnyStore, MemoryStore, Store, StoreContent
from ..io.keeping.mark import WorldKind, new_vessel_id
from ..io.loop import LoopApp, LoopStats, StopFlag, run
from ..io.recording import Recorder, Recording, new_run_dir
from ..io.recording.run_folders import free_bytes, make_room, take_back
from ..io.writer import Writer
from ..judge import vessel_warnings
from ..settings import Settings
from ..settings.schema import RecordConfig
from ..status.start import serve
from ..strangers import Lookout
from ..worlds import STORE_NAME, apart, check_run_dir, simulated_content, simulated_store
from .log_lines import never_waiting
from .numbers import positive
from .status import Journal, SnapshotView, StatusView, Views, Watched, airtime_of

log = logging.getLogger(__name__)
SHUT_DOWN: int = 3
"""Exit status after a station's PREFLIGHT_REBOOT_SHUTDOWN 2; the shipped unit does not start the program again then."""


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("run", help="sail the real vessel", description=__doc__)
    parser.add_argument("config", type=Path, help="TOML file; config/boat.toml is a commented example")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override one key")
    parser.add_argument(
        "--run-dir", type=Path, help="where this run is recorded (default: a new one in record.directory)"
    )
    parser.add_argument("--duration", type=positive, metavar="S", help="end after so many seconds")
    parser.add_argument("--status", action="store_true", help="show a status on the terminal")
    parser.add_argument(
        "--simulated",
        action="store_true",
        help="the world is 'companion sim --world-only': a store beside the run, runs apart from real ones",
    )
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Run until a signal ends it; neutral is written last."""
    settings = vessel_settings(arguments.config, arguments.set, to_sail=True, run_dir=arguments.run_dir)
    if arguments.simulated:
        boats = settings.record.directory
        settings = apart(settings, arguments.set)
        check_run_dir(arguments.run_dir or Path(settings.record.directory) / "new", boats)
    store = settings.store
    if arguments.simulated:
        store = "" if arguments.run_dir is None else str(arguments.run_dir / STORE_NAME)
    with own_store(arguments.config, store):
        return _sail(arguments, settings)


def _sail(arguments: argparse.Namespace, settings: Settings) -> int:
    world = WorldKind.SIMULATED if arguments.simulated else WorldKind.REAL
    never_waiting()
    stop = StopFlag().install()
    clock = SystemClock()
    run_dir = arguments.run_dir or new_run_dir(Path(settings.record.directory))
    if settings.record.enabled and settings.record.make_room:
        _make_room(settings.record)
    settings = in_run_dir(settings, run_dir)
    writer = Writer()
    store = _store(settings, world, run_dir, writer)
    about = describe(settings, world_kind=world.value, vessel_id=store.snapshot().vessel)
    recording = None
    if settings.record.enabled:
        limits = settings.record
        recorder = Recorder(
            run_dir, max_mb=limits.max_mb, free_floor_mb=limits.free_floor_mb, writer=writer, about=about
        )
        recording = Recording(recorder, clock.utc_us)
    try:
        app = build_app(settings, store=store, recording=recording, about=about)
    except BaseException:
        if recording is not None and arguments.run_dir is None:
            take_back(run_dir)
        raise
    log.info("running %s; %s", settings.system.name, _recorded(recording, run_dir))
    for _, text in app.storage.standing[len(store.warnings) :]:  # the warnings are told like all of them
        log.warning("%s", text)
    for warning in vessel_warnings(settings):
        log.warning("%s", warning)
    for door in vessel_doors(settings):
        log.info("socket: %s", door.line)
    stats = LoopStats()
    until_us = None if arguments.duration is None else clock.now_us() + round(arguments.duration * 1e6)
    driven: LoopApp = app if recording is None else recording.app(app)
    airtime = airtime_of(app.grounds)
    view: SnapshotView = StatusView(airtime=airtime) if arguments.status else Journal()
    say = app.controls.voice.say if recording is None else recording.recorder.tell
    service = serve(app, run_dir, say=say, airtime_fn=airtime)
    lookout = Lookout([port.link for port in app.grounds], say)
    stop.stays = lambda: _sails_on(app, say, clock.now_us())
    driven = Watched(driven, Views(view, lookout) if service is None else Views(view, lookout, service))
    try:
        status = run(driven, clock, stop, period_us=app.period_us, stats=stats, until_us=until_us)
        return SHUT_DOWN if app.shutdown_wanted and status == 0 else status
    finally:
        writer.close()


def _sails_on(app: App, say: Callable[[Severity, str], None], now_us: int) -> bool:
    """Whether the vessel goes on although the terminal that started it is gone: at sea nobody could start it again."""
    controls = app.controls
    if not controls.armed and not controls.voyage.has_begun(now_us):
        return False
    say(Severity.WARNING, f"Terminal closed: the vessel goes on; Disarm stops it, kill {os.getpid()} ends the program")
    return True


def _store(settings: Settings, world: WorldKind, run_dir: Path, writer: Writer) -> AnyStore:
    if world is WorldKind.SIMULATED:
        return simulated_store(run_dir / STORE_NAME, simulated_content(0), writer)
    if not settings.store:
        return MemoryStore(StoreContent(meta={"world": world.value, "vessel": new_vessel_id()}))
    return Store(Path(settings.store), writer, world=world, memory_ok=not settings.operator.store_required)


def _recorded(recording: Recording | None, run_dir: Path) -> str:
    """Where the run can be found afterwards, or that it cannot."""
    if recording is None:
        return "recorded in nothing"
    problems = [text for _, text in recording.recorder.texts]
    return f"NOT recorded in {run_dir}: {'; '.join(problems)}" if problems else f"recorded in {run_dir}"


def _make_room(record: RecordConfig) -> None:
    base, floor_bytes = Path(record.directory), record.free_floor_mb << 20
    wanted_bytes = floor_bytes + (record.max_mb << 20)
    for run_dir in make_room(base, wanted_bytes, floor_bytes=floor_bytes):
        log.warning("the disk is nearly full: the recording %s was deleted", run_dir)
    with contextlib.suppress(OSError):
        missing_mb = (wanted_bytes - free_bytes(base) + (1 << 20) - 1) >> 20
        if missing_mb > 0:
            log.warning(
                "the disk lacks %d MB for a whole recording, which will pause when it is full: "
                "lower record.max_mb, or clear the disk of other things",
                missing_mb,
            )


def describe(settings: Settings, **more: object) -> dict[str, Any]:
    """Return what ``run.json`` says of a run."""
    return {**made_by(), "settings": settings.model_dump(mode="json"), **more}
