"""Feeds the ground station's half of a recorded log to a fresh simulated vessel and collects what the vessel says."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import config as shipped
from companion.io.links.link import Received
from companion.report.from_tlog import find_vehicle
from companion.settings.schema import load
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode, dialect
from mavlink_bridge.mavlink.wire.framing import Deframer, Frame
from sitl.plant.truth import utc_us
from sitl.world.settings import SimSettings
from sitl.world.world import World

DATA = Path(__file__).resolve().parents[1] / "data"
ANSWERS = frozenset(
    {
        dialect.MAVLINK_MSG_ID_COMMAND_ACK,
        dialect.MAVLINK_MSG_ID_MISSION_COUNT,
        dialect.MAVLINK_MSG_ID_MISSION_REQUEST_INT,
        dialect.MAVLINK_MSG_ID_MISSION_REQUEST,
        dialect.MAVLINK_MSG_ID_MISSION_ITEM_INT,
        dialect.MAVLINK_MSG_ID_MISSION_ACK,
        dialect.MAVLINK_MSG_ID_MISSION_ITEM_REACHED,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    }
)
"""What a vessel says because it was asked, or once."""
_REPEATED = """
    HEARTBEAT SYS_STATUS SYSTEM_TIME GPS_RAW_INT ATTITUDE GLOBAL_POSITION_INT LOCAL_POSITION_NED VFR_HUD ALTITUDE ODOMETRY
    NAV_CONTROLLER_OUTPUT SERVO_OUTPUT_RAW MISSION_CURRENT DISTANCE_SENSOR BATTERY_STATUS HOME_POSITION EXTENDED_SYS_STATE
    POSITION_TARGET_GLOBAL_INT ORBIT_EXECUTION_STATUS FENCE_STATUS HIGH_LATENCY2 TIMESYNC GPS_GLOBAL_ORIGIN
    ESTIMATOR_STATUS NAMED_VALUE_FLOAT WATER_DEPTH CURRENT_MODE
"""
REPEATED = frozenset(getattr(dialect, f"MAVLINK_MSG_ID_{name}") for name in _REPEATED.split())


MACHINE = frozenset({"flight_sw_version", "os_sw_version", "uid", "param_index", "param_count", "capabilities"})
"""Fields that tell of the program's version, not of what it does."""
PATIENCE_US = 3_000_000


class Half:
    """One side of a log."""

    def __init__(self, frames: list[Frame]) -> None:
        self.messages: list[Any] = [message for frame in frames if (message := decode(frame)) is not None]

    def answers(self) -> dict[str, list[str]]:
        """The fields of every answer, in order, by message."""
        found: dict[str, list[str]] = {}
        for message in self.messages:
            if message.get_msgId() in ANSWERS:
                fields = {
                    name: _shown(getattr(message, name)) for name in message.get_fieldnames() if name not in MACHINE
                }
                found.setdefault(message.get_type(), []).append(
                    ", ".join(f"{key}={value}" for key, value in fields.items())
                )
        return found

    def modes(self) -> list[tuple[int, bool]]:
        """(custom mode, armed) in the order in which they were shown."""
        found: list[tuple[int, bool]] = []
        for message in self.messages:
            if message.get_type() == "HEARTBEAT":
                state = (message.custom_mode, bool(message.base_mode & 128))
                if not found or found[-1] != state:
                    found.append(state)
        return found

    def texts(self) -> list[str]:
        """Texts without their numbers, which noise makes."""
        said = [str(message.text) for message in self.messages if message.get_type() == "STATUSTEXT"]
        return [re.sub(r"-?\d+(\.\d+)?", "N", text) for text in said]


def _shown(value: Any) -> Any:
    return "nan" if isinstance(value, float) and math.isnan(value) else value


class Log:
    """A recorded log: the vessel's half, and what the ground station said with what it had heard before saying it."""

    def __init__(self, path: Path) -> None:
        records = list(tlog.iterate(path.read_bytes()))
        vehicle = find_vehicle(records)
        assert vehicle is not None
        self.system = vehicle[0]
        self.said: list[tuple[int, bytes, Counter[int]]] = []
        """(simulated time in us, frame, answers heard before, by message)."""
        self.end_us = max(record.t_us for record in records) - utc_us(0)
        heard: Counter[int] = Counter()
        frames = []
        for record in records:
            if record.frame.system == self.system:
                frames.append(record.frame)
                heard[record.frame.message_id] += record.frame.message_id in ANSWERS
            else:
                self.said.append((record.t_us - utc_us(0), record.frame.raw, heard.copy()))
        self.vessel = Half(frames)


class Retelling:
    """A fresh simulated vessel, and a ground station that says what the log's station said.

    It says each thing at its time, but not before it has heard what the other had heard: a live vessel's ticks fall a few
    milliseconds away from the simulator's grid, and a question must not overtake the answer that led to it.
    """

    def __init__(self, log: Log, endpoint: str) -> None:
        settings = (f"system.system_id={log.system}", "operator.gcs_required=false")
        self.world = World(load(shipped.path("sim.toml"), settings, SimSettings), 0)
        self._log = log
        # The log was written at the vessel's radio port: the words come there, not through the air once more.
        self._ground = (
            self.world.surroundings._hosts.pop(0).link if endpoint == "radio" else self.world.ground(endpoint)
        )
        self._deframer = Deframer()
        self._frames: list[Frame] = []
        self._heard: Counter[int] = Counter()

    def run(self) -> Half:
        for at_us, raw, before in self._log.said:
            while self.world.now_us + self.world.period_us <= at_us:
                self._step()
            patience_us = self.world.now_us + PATIENCE_US
            while any(self._heard[kind] < count for kind, count in before.items()) and self.world.now_us < patience_us:
                self._step()
            self._ground.write(0, raw)
            self.world.pump(self.world.now_us + 10_000)
            self._listen()
        while self.world.now_us < self._log.end_us:
            self._step()
        return Half([frame for frame in self._frames if frame.system == self._log.system])

    def _step(self) -> None:
        self.world.step()
        self._listen()

    def _listen(self) -> None:
        for event in self._ground.poll(self.world.now_us):
            if isinstance(event, Received):
                found = self._deframer.receive(event.data, self.world.now_us)
                self._frames += found
                self._heard.update(frame.message_id for frame in found)
