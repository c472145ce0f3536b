"""Makes most of ``tests/recorded`` again: what a ground station heard and said, with each persona, fault and radio.

``python -m tests.replay.record_own [NAME…]``. The QGC-like client's are sailed in virtual time and come out the same each time;
those of MAVSDK and MAVProxy are live (``record_tlogs``). Kept are every frame of the station and the answers, and of what repeats by
itself one frame in five seconds.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import config as shipped
from companion.io.links.link import LinkEvent, Received
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.framing import Deframer
from sitl.plant.truth import utc_us
from sitl.world.settings import SimSettings
from tests.qgc_buttons import HOLD, Generation
from tests.qgc_rig import Screen
from tests.replay.record_tlogs import cut, live
from tests.replay.recorded import HERE
from tests.scenario.test_radio_qgc import LOITER, MEMORY, Shore

FTP: Final = 110
FILE_FRAMES: Final = 6
"""A station fetches the descriptions of all parameters: the first frames of it are kept."""


class Taped:
    """A station's link that writes down both directions, as a station's own log does."""

    def __init__(self, link: Any) -> None:
        self._link = link
        self._deframers = Deframer(), Deframer()
        self.log = bytearray()
        self._files = 0

    def poll(self, now_us: int) -> list[LinkEvent]:
        events = list(self._link.poll(now_us))
        for event in events:
            if isinstance(event, Received):
                self._note(0, event.data, now_us)
        return events

    def write(self, channel: int, data: bytes) -> int:
        self._note(1, data, self._now_us)
        return self._link.write(channel, data)

    def _note(self, side: int, data: bytes, now_us: int) -> None:
        self._now_us = now_us
        for frame in self._deframers[side].receive(data, now_us):
            self._files += frame.message_id == FTP
            if frame.message_id != FTP or self._files <= FILE_FRAMES:
                self.log += tlog.pack(utc_us(now_us), 0, frame.raw)

    _now_us = 0


def screen(*overrides: str, **more: Any) -> Screen:
    made = Screen(*overrides, **more)
    made.link = Taped(made.link)
    made.run()
    made.wait(3.0)
    return made


def sailing(*overrides: str, **more: Any) -> Screen:
    """Connected, a plan uploaded, started and 20 s under way."""
    made = screen(*overrides, **more)
    made.run(made.client.upload_plan(made.plan((60.0, 0.0), (60.0, 60.0))))
    made.run(made.client.start_mission())
    made.wait(20.0)
    return made


def a_day(persona: str, generation: Generation) -> bytes:
    """Plan, start, hold, go on, disarm."""
    if persona == "generic":
        return a_day_by_commands(generation)
    made = sailing(persona=persona, generation=generation)
    made.run(made.client.mode_menu(HOLD))
    made.wait(8.0)
    made.run(made.client.continue_mission())
    made.wait(8.0)
    made.run(made.client.disarm())
    made.wait(3.0)
    return bytes(made.link.log)


def a_day_by_commands(generation: Generation) -> bytes:
    """A station that takes the vessel for an unknown autopilot shows few buttons: its commands still do."""
    made = screen(persona="generic", generation=generation)
    made.run(made.client.upload(0, made.plan((60.0, 0.0), (60.0, 60.0))[1:]))
    for command, *values in ((400, 1.0), (300, 0.0, 0.0), (193, 0.0), (193, 1.0), (400, 0.0)):
        made.run(made.client.command(command, *values))
        made.wait(8.0)
    return bytes(made.link.log)


def with_fault(
    break_it: Callable[[Screen], object], *overrides: str, mend: Callable[[Screen], object] | None = None
) -> bytes:
    made = sailing(*overrides)
    break_it(made)
    made.wait(12.0)
    if mend is not None:
        mend(made)
        made.wait(8.0)
    return bytes(made.link.log)


def sensor(name: str, value: Any) -> Callable[[Screen], object]:
    return lambda made: made.world.surroundings.plant.sensors.faults.set(name, value)


def silent(made: Screen) -> None:
    made.present = False


def over_the_radio(profile: str, folder: Path | None, *overrides: str) -> bytes:
    """The client on the shore modem itself, or on the gateway (``folder``)."""
    shore = Shore(
        load(shipped.path("sim.toml"), [*MEMORY, f"radio.profile={profile}", *overrides], SimSettings), folder
    )
    shore.link = Taped(shore.link)
    shore.run(limit_s=300.0)
    shore.wait(20.0)
    shore.run(shore.client.upload(0, LOITER))
    shore.run(shore.client.command(400, 1.0))
    shore.run(shore.client.command(300, 0.0, 0.0))
    shore.wait(40.0)
    return bytes(shore.link.log)


def by_gateway() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return over_the_radio("o-10", Path(folder))


def by_json() -> bytes:
    """A plan comes by the seed's JSON; the station beside it watches."""
    made = Screen("radio.protocol=json", "radio.profile=bench", "operator.gcs_required=false")
    made.link = Taped(made.link)
    made.run()
    made.wait(8.0)
    lat_deg, lon_deg = (value / 1e7 for value in made.at(40.0, 15.0))
    plan = {"ID": "loiter-1", "Latitude": lat_deg, "Longitude": lon_deg, "Duration": 20, "Loiter type": "Circular"}
    modem = made.world.ground("shore")
    modem.poll(0)
    modem.write(0, json.dumps(plan | {"Speed": 3.0, "Length": 0, "Radius": 15}).encode() + b"\n")
    made.wait(70.0)
    return bytes(made.link.log)


def board(what: str) -> Callable[[Screen], object]:
    def do(made: Screen) -> None:
        twin: Any = made.world.surroundings.plant.board
        twin.set_estop(True) if what == "stop" else getattr(twin, what)(made.world.now_us)

    return do


def unplugged(made: Screen) -> None:
    made.world.vessel_end("actuators").unplug()


def plugged(made: Screen) -> None:
    made.world.vessel_end("actuators").plug()
    made.wait(6.0)
    made.world.app.submit(Arm(True))


SHOAL = ("world.bottom.mounds=[]", "world.bottom.slope={bearing_deg=0, start_m=10, gradient=0.5}")
SAILED: Final[dict[str, Callable[[], bytes]]] = {
    "qgc-ardurover": lambda: a_day("ardurover", Generation.V5),
    "qgc-generic": lambda: a_day("generic", Generation.V4),
    "fault-gnss-silent": lambda: with_fault(sensor("gnss_silent", True), mend=sensor("gnss_silent", False)),
    "fault-heading-flip": lambda: with_fault(sensor("heading_bias_deg", 170.0)),
    "fault-sounder-silent": lambda: with_fault(sensor("depth_silent", True)),
    "fault-shoal": lambda: with_fault(lambda made: made.wait(20.0), *SHOAL),
    "fault-board-hangs": lambda: with_fault(board("hang")),
    "fault-stop-switch": lambda: with_fault(board("stop")),
    "fault-board-unplugged": lambda: with_fault(unplugged, mend=plugged),
    "fault-station-lost": lambda: with_fault(silent, mend=lambda made: setattr(made, "present", True)),
    "radio-plain": lambda: over_the_radio("plain-10", None, "radio.protocol=mavlink"),
    "radio-gateway": by_gateway,
    "radio-json": by_json,
}
LIVE: Final = {
    "mavsdk-ardurover": ("mavsdk", "ardurover"),
    "mavsdk-generic": ("mavsdk", "generic"),
    "mavproxy-ardurover": ("mavproxy", "ardurover"),
    "mavproxy-generic": ("mavproxy", "generic"),
}
"""Real clients: recording -> client and persona."""


def main() -> None:
    """Record all, or those named."""
    wanted = sys.argv[1:] or [*SAILED, *LIVE]
    for name in wanted:
        log = SAILED[name]() if name in SAILED else live(*LIVE[name])
        (HERE / f"{name}.tlog").write_bytes(log if name in LIVE else cut(log, 0))
        print(name, (HERE / f"{name}.tlog").stat().st_size, "bytes", flush=True)
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", "tests/replay/test_recorded.py", "--update-expected"],
        check=True,
    )


if __name__ == "__main__":
    main()
