"""MAVSDK as the ground station: upload speed + loiter, arm, start, and say when each step was done.

Run by the tests in a process of its own: ``mavsdk_loiter.py URL LAT_DEG LON_DEG LOITER_S [ardurover] [--radius-m R]``.
Prints one JSON object a line.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.action import Action
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw
from mavsdk.plugins.telemetry import Telemetry


def say(step: str, **more: Any) -> None:
    print(json.dumps({"step": step, "at_s": round(time.monotonic() - BEGAN, 2), **more}), flush=True)


def retry(what: str, call: Any, tries: int = 20, pause_s: float = 0.5) -> None:
    for attempt in range(tries):
        try:
            call()
        except Exception as error:
            if attempt == tries - 1:
                raise
            say("retry", what=what, error=str(error))
            time.sleep(pause_s)
        else:
            say(what)
            return


BEGAN = time.monotonic()


def main(url: str, lat_deg: float, lon_deg: float, *, loiter_s: float, radius_m: float, autopilot: bool) -> None:
    sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    result = sdk.add_any_connection(url)
    say("connection", result=int(result))
    system = sdk.first_autopilot(60.0)
    if system is None:
        raise SystemExit("no autopilot found")
    say("connected")
    telemetry, action, mission = Telemetry(system), Action(system), MissionRaw(system)
    x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
    nan = float("nan")
    home = [MissionItem(0, 0, 16, 1, 1, 0, 0, 0, nan, x, y, 0, 0)] if autopilot else []
    first = len(home)
    items = [
        *home,
        MissionItem(first, 2, 178, 0 if home else 1, 1, 1, 1.5, -1, 0, 0, 0, 0, 0),
        MissionItem(first + 1, 3, 19, 0, 1, loiter_s, 0, radius_m, 1, x, y, 0, 0),
    ]
    retry("uploaded", lambda: mission.upload_mission(items))
    downloaded: list[MissionItem] = []
    retry("read back", lambda: downloaded.extend(mission.download_mission()))
    say("downloaded", items=[[item.command, item.param1, item.param3, item.x, item.y] for item in downloaded])
    retry("armed", action.arm)
    retry("started", mission.start_mission)
    deadline = time.monotonic() + 600
    while time.monotonic() < deadline:
        progress = mission.mission_progress()
        mode = telemetry.flight_mode()
        say("progress", current=progress.current, total=progress.total, mode=int(mode), armed=telemetry.armed())
        if progress.total and progress.current >= progress.total:
            break
        time.sleep(1.0)
    say("done")


if __name__ == "__main__":
    words = argparse.ArgumentParser()
    words.add_argument("url")
    for name in ("lat_deg", "lon_deg", "loiter_s"):
        words.add_argument(name, type=float)
    words.add_argument("flavour", nargs="?", choices=["ardurover"])
    words.add_argument("--radius-m", type=float, default=20.0)
    told = words.parse_args()
    main(
        told.url,
        told.lat_deg,
        told.lon_deg,
        loiter_s=told.loiter_s,
        radius_m=told.radius_m,
        autopilot=told.flavour is not None,
    )
