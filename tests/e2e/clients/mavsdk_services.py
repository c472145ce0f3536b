"""MAVSDK plug-ins one after the other against the simulated vessel: does each do what its documentation says?

``mavsdk_services.py URL PERSONA LAT_DEG LON_DEG`` in real time. Prints one JSON object a line, and last those lines of
MAVSDK's own log that are warnings or errors.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import threading
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mavsdk import ComponentType, Configuration, LogLevel, Mavsdk, log_subscribe
from mavsdk.plugins.action import Action, ActionError, OrbitYawBehavior
from mavsdk.plugins.geofence import Circle, FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.info import Info
from mavsdk.plugins.log_files import LogFiles, LogFilesResult
from mavsdk.plugins.manual_control import ManualControl
from mavsdk.plugins.mission import Mission, MissionError, MissionItem, MissionPlan
from mavsdk.plugins.mission_raw import MissionItem as RawItem, MissionRaw
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.telemetry import Telemetry

BEGAN = time.monotonic()
COMPLAINTS: list[str] = []
HOLD, MISSION, RETURN = 3, 4, 5
NAN = math.nan


def say(step: str, **more: Any) -> None:
    print(json.dumps({"step": step, "at_s": round(time.monotonic() - BEGAN, 2), **more}), flush=True)


def log(level: LogLevel, text: str, *_: Any) -> bool:
    if level in (LogLevel.WARN, LogLevel.ERROR):
        COMPLAINTS.append(text)
    return True


def wait(what: str, holds: Callable[[], bool], limit_s: float = 15.0) -> None:
    deadline = time.monotonic() + limit_s
    while not holds():
        if time.monotonic() > deadline:
            raise SystemExit(f"never: {what}")
        time.sleep(0.05)
    say(what)


class Client:
    """One connected MAVSDK with the vehicle."""

    def __init__(self, url: str, persona: str, lat_deg: float, lon_deg: float) -> None:
        self.lat, self.lon = lat_deg, lon_deg
        self.rover = persona == "ardurover"
        self.sdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        self.sdk.add_any_connection(url)
        system = self.sdk.first_autopilot(60.0)
        if system is None:
            raise SystemExit("no autopilot found")
        self.system = system
        self.telemetry, self.action = Telemetry(system), Action(system)
        self.mission = Mission(system)

    def telemetry_flows(self) -> None:
        telemetry = self.telemetry
        wait("health all ok", telemetry.health_all_ok, 30.0)
        wait("position", lambda: abs(telemetry.position().latitude_deg - self.lat) < 0.01)
        wait("home", lambda: abs(telemetry.home().latitude_deg - self.lat) < 0.01)
        wait("gps", lambda: telemetry.gps_info().num_satellites > 5)
        wait("attitude", lambda: not math.isnan(telemetry.attitude_euler().yaw_deg))
        telemetry.set_rate_position(10.0)
        telemetry.set_rate_attitude_euler(10.0)
        say("rates set")

    def information(self) -> None:
        info = Info(self.system)
        version, product = info.get_version(), info.get_product()
        say("info", major=version.flight_sw_major, minor=version.flight_sw_minor, vendor=product.vendor_id)

    def parameters(self) -> None:
        param = Param(self.system)
        began = time.monotonic()
        everything = param.get_all_params()
        say(
            "params",
            floats=len(everything.float_params),
            ints=len(everything.int_params),
            took_s=time.monotonic() - began,
        )
        param.set_param_float("CRUISE_SPEED", 1.25)
        say("param set", value=param.get_param_float("CRUISE_SPEED"))
        for name, value in (("CRUISE_SPEED", -5.0), ("NO_SUCH_PARAM", 1.0)):
            try:
                param.set_param_float(name, value)
            except ParamError as error:
                say("param refused", name=name, why=str(error))
            else:
                raise SystemExit(f"{name} = {value} was taken")
        COMPLAINTS.clear()

    def logs(self) -> None:
        """MAVSDK counts logs from 0; those of the Rover face begin at 1, as ArduPilot's do, and it takes the last for none."""
        if self.rover:
            return
        files = LogFiles(self.system)
        entries = files.get_entries()
        say("logs", sizes=[entry.size_bytes for entry in entries], first=entries[0].date)
        ends: list[LogFilesResult] = []
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "log"
            files.download_log_file_async(entries[0], str(path), lambda result, *_: ends.append(result))
            wait("log downloaded", lambda: bool(ends) and ends[-1] != LogFilesResult.NEXT, 30)
            say("log", result=ends[-1].name, crc=zlib.crc32(path.read_bytes()))

    def fence(self) -> None:
        geofence = Geofence(self.system)
        corners = [(-0.004, -0.004), (-0.004, 0.004), (0.004, 0.004), (0.004, -0.004)]
        square = Polygon([Point(self.lat + a, self.lon + b) for a, b in corners], FenceType.INCLUSION)
        rock = Circle(Point(self.lat + 0.003, self.lon), 30.0, FenceType.EXCLUSION)
        geofence.upload_geofence(GeofenceData([square], [rock]))
        back = geofence.download_geofence()
        say("fence", polygons=[len(p.points) for p in back.polygons], circles=[c.radius for c in back.circles])
        geofence.clear_geofence()

    def raw_mission(self) -> None:
        raw = MissionRaw(self.system)
        x, y = round(self.lat * 1e7), round(self.lon * 1e7)
        home = [RawItem(0, 0, 16, 1, 1, 0, 0, 0, NAN, x, y, 0, 0)] if self.rover else []
        first = len(home)
        items = [
            *home,
            RawItem(first, 3, 16, 0 if home else 1, 1, 0, 0, 0, NAN, x + 1000, y, 0, 0),
            RawItem(first + 1, 3, 18, 0, 1, 2, 0, -25, 1, x, y, 0, 0),
        ]
        raw.upload_mission(items)
        back = raw.download_mission()
        say("raw mission", items=[[i.command, i.param1, i.param3, i.x, i.y] for i in back[first:]])
        raw.set_current_mission_item(first + 1)
        say("raw current set")
        if not self.rover:
            raw.clear_mission()
            say("raw cleared", left=len(raw.download_mission()))

    def plain_mission(self) -> None:
        """The Mission plug-in counts no home item; the Rover face must refuse it rather than lose its first point."""
        mission = self.mission
        points = [(0.0002, 0.0), (0.0002, 0.0003)]
        items = [
            MissionItem(self.lat + a, self.lon + b, 0.0, speed_m_s=2.0, is_fly_through=True, acceptance_radius_m=3.0)
            for a, b in points
        ]
        mission.set_return_to_launch_after_mission(False)
        try:
            mission.upload_mission(MissionPlan(items))
        except MissionError as error:
            say("mission refused", why=str(error))
        else:
            say("mission uploaded", back=len(mission.download_mission().mission_items))

    def sail_mission(self) -> None:
        """Start, pause, go on, finish; by the Mission plug-in, or by MissionRaw where item 0 is home."""
        x, y = round(self.lat * 1e7), round(self.lon * 1e7)
        if self.rover:
            flown: Any = MissionRaw(self.system)
            flown.upload_mission(
                [
                    RawItem(0, 0, 16, 1, 1, 0, 0, 0, NAN, x, y, 0, 0),
                    RawItem(1, 2, 178, 0, 1, 1, 2.0, -1, 0, 0, 0, 0, 0),
                    RawItem(2, 3, 16, 0, 1, 0, 0, 0, NAN, x + 2000, y, 0, 0),
                    RawItem(3, 3, 16, 0, 1, 0, 0, 0, NAN, x + 2000, y + 3000, 0, 0),
                ]
            )
        else:
            flown = self.mission
        self.action.arm()
        wait("armed", self.telemetry.armed)
        flown.start_mission()
        wait("mission mode", lambda: int(self.telemetry.flight_mode()) == MISSION)
        wait("under way", lambda: self.speed_mps() > 0.8, 30)
        flown.pause_mission()
        wait("paused", lambda: int(self.telemetry.flight_mode()) == HOLD)
        flown.start_mission()
        wait("mission again", lambda: int(self.telemetry.flight_mode()) == MISSION)
        wait("mission finished", lambda: self.is_finished(flown), 120)

    def is_finished(self, flown: Any) -> bool:
        if not self.rover:
            return bool(flown.is_mission_finished())
        progress = flown.mission_progress()
        return bool(progress.total and progress.current >= progress.total)

    def speed_mps(self) -> float:
        velocity = self.telemetry.velocity_ned()
        return math.hypot(velocity.north_m_s, velocity.east_m_s)

    def guided(self) -> None:
        action = self.action
        action.set_current_speed(1.5)
        action.goto_location(self.lat - 0.0003, self.lon, 0.0, NAN)
        wait("go-to", lambda: self.telemetry.velocity_ned().north_m_s < -0.5, 30)
        action.do_orbit(15.0, 1.5, OrbitYawBehavior(0), self.lat - 0.0003, self.lon, 0.0)
        say("orbit")
        action.hold()
        wait("hold", lambda: int(self.telemetry.flight_mode()) == HOLD)
        action.return_to_launch()
        wait("return", lambda: int(self.telemetry.flight_mode()) == RETURN)
        try:
            action.takeoff()
        except ActionError as error:
            say("takeoff refused", why=str(error))
        COMPLAINTS.clear()

    def steer(self) -> None:
        manual = ManualControl(self.system)
        stop = threading.Event()

        def stick() -> None:
            while not stop.wait(0.05):
                manual.set_manual_control_input(0.0, 0.0, 0.6, 0.0)

        thread = threading.Thread(target=stick)
        thread.start()
        try:
            time.sleep(0.3)
            if not self.rover:
                manual.start_position_control()
                wait("sticks move the boat", lambda: self.speed_mps() > 0.7, 30)
        finally:
            stop.set()
            thread.join()
        self.action.kill()
        wait("disarmed", lambda: not self.telemetry.armed())


def main(url: str, persona: str, lat_deg: float, lon_deg: float) -> None:
    log_subscribe(log)
    client = Client(url, persona, lat_deg, lon_deg)
    say("connected")
    for step in (
        client.telemetry_flows,
        client.information,
        client.parameters,
        client.logs,
        client.fence,
        client.raw_mission,
        client.plain_mission,
        client.sail_mission,
        client.guided,
        client.steer,
    ):
        step()
        if COMPLAINTS:
            say("complaints", after=step.__name__, lines=COMPLAINTS)
            COMPLAINTS.clear()
    say("done")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
