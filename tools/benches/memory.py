"""What a process keeps over time: resident memory of a vessel at rest, alone and with three ground stations.

The first hour fills what is bounded (the airtime of an hour, the newest packets, the filters of each link); after it nothing may grow.
"""

from __future__ import annotations

import gc
import os
import tempfile
from pathlib import Path
from typing import Any

import config as shipped
from companion.settings import load
from mavlink_bridge.mavlink.wire.codec import Codec, dialect
from sitl.world import SimSettings, World
from tools.figures import row

HOUR_S = 3600
DAY_BAR_MB = 1.0


def _said(second: int) -> list[tuple[int, Any]]:
    """What a station repeats: every so many seconds, a message."""
    return [
        (
            1,
            dialect.MAVLink_heartbeat_message(
                type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
            ),
        ),
        (5, dialect.MAVLink_param_request_read_message(1, 1, b"DEPTH_MIN", -1)),
        (7, dialect.MAVLink_timesync_message(0, second * 1000)),
        (
            11,
            dialect.MAVLink_command_long_message(
                target_system=1,
                target_component=1,
                command=512,
                confirmation=0,
                param1=148,
                param2=0,
                param3=0,
                param4=0,
                param5=0,
                param6=0,
                param7=0,
            ),
        ),
        (13, dialect.MAVLink_mission_request_list_message(1, 1, 0)),
    ]


def run() -> list[dict[str, Any]]:
    """Growth of the resident memory after the first hour, as a day would show it."""
    hours = float(os.environ.get("BENCH_HOURS", "2"))
    with tempfile.TemporaryDirectory() as folder:
        alone = growth_mb(Path(folder) / "alone", hours, stations=0)
        watched = growth_mb(Path(folder) / "watched", hours, stations=3)
    return [
        row("memory: a day at rest, after the first hour", alone * 24.0, "MB", DAY_BAR_MB),
        row("memory: 2 h with three stations, after the first hour", watched * 2.0, "MB", DAY_BAR_MB),
    ]


def growth_mb(run_dir: Path, hours: float, *, stations: int) -> float:
    """Growth in an hour, MB: a vessel at rest that records, with so many ground stations that talk, from its first hour on."""
    settings = load(shipped.path("sim.toml"), ["operator.gcs_required=false"], SimSettings)
    world = World(settings, 1, run_dir=run_dir)
    rest(world, HOUR_S, stations)
    before_kb, rested_s = resident_kb(), round((hours - 1.0) * HOUR_S)
    rest(world, rested_s, stations)
    grown_kb = resident_kb() - before_kb
    world.shutdown(world.now_us)
    return grown_kb / 1024.0 * HOUR_S / rested_s


def rest(world: World, seconds: int, stations: int) -> None:
    """Let time pass, the stations saying what real ones repeat."""
    links = [world.ground(name) for name in ("gcs", "sdk", "tcp")[:stations]]
    codecs = [Codec(255 - number, 190) for number in range(stations)]
    for second in range(seconds):
        for link, codec in zip(links, codecs, strict=True):
            for every_s, message in _said(second):
                if second % every_s == 0:
                    link.write(0, codec.encode(message))
        world.run(1.0)
        for link in links:
            link.poll(world.now_us)


def resident_kb() -> int:
    """Resident memory of this process, once what is garbage has been let go."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024
