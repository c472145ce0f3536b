"""What an operator presses in front of the screen: QGroundControl's buttons with its windows, repeats and pop-ups, as measured.

Times and texts are those of qgc-real.md (QGroundControl 4.3 run against the simulator, its source of 2026 read): a mode is sent
three times with 1.3 s each for the HEARTBEAT to show it, an arming waits 1.5 s for the armed bit, every plan transfer waits
1.5 s for its final acknowledgement and does not repeat. Each message box that would open is one entry of ``report.popups``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

import config
from mavlink_bridge.mavlink.wire.codec import dialect

Steps = Generator[tuple[str, Any, float], Any, Any]

ARM, SET_MODE, MISSION_START, REPOSITION, REBOOT, MOTOR_TEST = 400, 176, 300, 192, 246, 209
MANUAL, HOLD, LOITER, AUTO, RTL, GUIDED = 0, 4, 5, 10, 11, 15
FORCE = 21196
ARDUPILOT: Final = 3
MODE_TRIES, MODE_S, ARM_S, PLAN_S = 3, 1.3, 1.5, 1.5
LOOK_S = 0.5
"""A timer that runs from the vehicle's first HEARTBEAT looks so often for commands whose wait is over (sources of 4.3 and of 2026)."""
MODE_NAMES: Final = {MANUAL: "Manual", HOLD: "Hold", LOITER: "Loiter", AUTO: "Auto", RTL: "RTL", GUIDED: "Guided"}
_RESULTS: Final = {1: "temporarily rejected", 2: "denied", 3: "not supported", 4: "failed", 6: "cancelled"}


class Generation(Enum):
    """The rules of one line of releases."""

    V4 = "4.3"
    V5 = "5.x"

    @property
    def answer_s(self) -> float:
        """How long any command waits for its acknowledgement."""
        return 3.0 if self is Generation.V4 else 1.2

    @property
    def asks_protocol_version(self) -> bool:
        """4.x takes a vehicle that does not answer PROTOCOL_VERSION for MAVLink 1: no fence, no rally."""
        return self is Generation.V4

    @property
    def asks_modes(self) -> bool:
        return self is Generation.V5

    @property
    def knows_param_error(self) -> bool:
        return self is Generation.V5


def _channels(first: int, last: int, end: str) -> tuple[str, ...]:
    return tuple(f"RC{number}_{end}" for number in range(first, last + 1))


SETUP_PAGES: Final[dict[str, tuple[str, ...]]] = {
    "Summary": (*(f"MODE{number}" for number in range(1, 7)), "COMPASS_DEC", "BATT_MONITOR", "FRAME_CLASS"),
    "Frame": ("FRAME_CLASS",),
    "Radio": (*_channels(1, 8, "REV"),),
    "Flight Modes": (*(f"MODE{number}" for number in range(1, 7)), *_channels(6, 16, "OPTION")),
    "Sensors": ("COMPASS_DEC", "AHRS_ORIENTATION"),
    "Power": ("BATT_MONITOR",),
}
"""Parameters that a page of Vehicle Setup asks for; each page that misses some opens "Parameters are missing from firmware".

RCn_REV may be RCn_REVERSED instead; MODEn is asked for when MODE1 exists, else FLTMODEn.
"""


@dataclass
class _Asked:
    deadline_us: int
    shows_error: bool
    pressed_us: int = 0


class Buttons:
    """Mixed into ``QgcClient``: it has the wire, the state and the pop-ups."""

    report: Any
    vehicle: int | None
    generation: Generation
    mode: int | None
    armed: bool
    autopilot: int
    wants_mode: int | None = None
    wants_armed = False
    """What was last pressed."""
    _now_us: int
    _outstanding: dict[int, _Asked]
    _started_us: int
    _looked_us: int = 0

    @property
    def mode_shown(self) -> str:
        """The mode's name in the toolbar; of a vehicle that is not ArduPilot's 4.x shows a number, 5.x what it was told."""
        number = self.mode or 0
        if self.autopilot == ARDUPILOT:
            return MODE_NAMES.get(number, str(number))
        names: dict[int, str] = self.report.mode_names
        return names.get(number, f"Custom:0x{number:x}")

    # ---- commands that wait beside everything else

    def press(self, command: int, *params: float, shows_error: bool = True) -> None:
        """Send a command once; its answer, or silence, opens a box by itself."""
        if command in self._outstanding:
            if shows_error:
                self._popup("Waiting on previous response to same command.")
            return
        if command == SET_MODE:
            self.wants_mode = round(params[1])
        elif command == ARM:
            self.wants_armed = bool(params[0])
        deadline_us = self._now_us + round(self.generation.answer_s * 1e6)
        self._outstanding[command] = _Asked(deadline_us, shows_error, self._now_us)
        self._command_long(command, *params)

    def _answered(self, message: Any) -> None:
        asked = self._outstanding.get(message.command)
        if asked is None:
            return
        if message.result == 5:
            asked.deadline_us = self._now_us + round(self.generation.answer_s * 1e6)
            return
        del self._outstanding[message.command]
        self.report.answers.append((message.command, (self._now_us - asked.pressed_us) * 1e-6))
        words = _RESULTS.get(message.result)
        if words is not None and asked.shows_error:
            self._popup(f"{_name(message.command)} command {words}")

    def _expire(self, now_us: int) -> None:
        look_us = now_us - (now_us - self._started_us) % round(LOOK_S * 1e6)
        if look_us <= self._looked_us:
            return
        self._looked_us = look_us
        for command, asked in list(self._outstanding.items()):
            if look_us > asked.deadline_us:
                del self._outstanding[command]
                if asked.shows_error:
                    self._popup(f"Vehicle did not respond to command: {_name(command)}")

    # ---- the buttons

    def mode_menu(self, number: int) -> Steps:
        """The mode menu sends once and looks no further. Returns when the command is answered or given up."""
        self.press(SET_MODE, 1, number)
        while SET_MODE in self._outstanding:
            yield ("answer to the mode", lambda message: SET_MODE not in self._outstanding, 0.1)

    def validated_mode(self, number: int) -> Steps:
        """Three times: send the mode, wait 1.3 s for the HEARTBEAT to show it. Returns whether it did."""
        for _ in range(MODE_TRIES):
            if self.mode == number:
                return True
            self.press(SET_MODE, 1, number)
            yield (f"mode {number}", lambda message: self.mode == number, MODE_S)
        return self.mode == number

    def validated_arm(self) -> Steps:
        """Send the arming once, wait 1.5 s for the armed bit. Returns whether it came."""
        if not self.armed:
            self.press(ARM, 1, shows_error=False)
            yield ("the armed bit", lambda message: self.armed, ARM_S)
        return self.armed

    def start_mission(self) -> Steps:
        """The start slider: Guided, arm, MISSION_START."""
        if not (yield from self.validated_mode(GUIDED)):
            self._popup("Unable to start mission: Vehicle failed to change to Guided mode.")
            return False
        if not (yield from self.validated_arm()):
            self._popup("Unable to start mission: Vehicle failed to arm.")
            return False
        self.press(MISSION_START, 0, 0)
        while MISSION_START in self._outstanding:
            yield ("answer to the start", lambda message: MISSION_START not in self._outstanding, 0.1)
        return True

    def action(self, label: str) -> Steps:
        """A button of this generation's action file: its command, once. Raises KeyError for a label that the file lacks."""
        entry = _actions(self.generation)[label]
        command = entry["mavCmd"]
        self.press(command, *(entry.get(f"param{number}", 0) for number in range(1, 8)))
        while command in self._outstanding:
            yield ("answer to the action", lambda message: command not in self._outstanding, 0.1)

    def arm(self) -> Steps:
        """The arm slider of the toolbar: it waits for the acknowledgement only."""
        self.press(ARM, 1)
        while ARM in self._outstanding:
            yield ("answer to arming", lambda message: ARM not in self._outstanding, 0.1)

    def disarm(self) -> Steps:
        """Disarm sends the force number too."""
        self.press(ARM, 0, FORCE)
        while ARM in self._outstanding:
            yield ("answer to disarming", lambda message: ARM not in self._outstanding, 0.1)

    def continue_mission(self) -> Steps:
        if not (yield from self.validated_mode(AUTO)):
            self._popup("Unable to continue mission: Vehicle failed to change to Auto mode.")
            return False
        return True

    def return_home(self) -> Steps:
        if not (yield from self.validated_mode(RTL)):
            self._popup("Unable to return: Vehicle failed to change to RTL mode.")
            return False
        return True

    def pause(self) -> Steps:
        """QGroundControl's Pause on a rover: a box, and nothing on the wire."""
        self._popup("Change altitude not supported.")
        yield from ()

    def land(self) -> Steps:
        self._popup("Guided mode not supported by Vehicle.")
        yield from ()

    def go_to(self, lat_e7: int, lon_e7: int) -> Steps:
        """DO_REPOSITION, Guided and ArduPilot's guided item: QGroundControl sends all three."""
        assert self.vehicle is not None
        self.send_message(
            dialect.MAVLink_command_int_message(
                self.vehicle, 1, 0, REPOSITION, 0, 0, -1, 1, 0, math.nan, lat_e7, lon_e7, 0.0
            )
        )
        self.press(SET_MODE, 1, GUIDED)
        self.send_message(
            dialect.MAVLink_mission_item_int_message(
                self.vehicle, 1, 0, 3, 16, 2, 1, 0, 0, 0, 0, lat_e7, lon_e7, 0.0, 0
            )
        )
        ack = yield ("answer to the guided item", lambda message: message.get_type() == "MISSION_ACK", PLAN_S)
        if ack is None:
            self._popup("Vehicle did not respond to mission item communication: guided item")
        elif ack.type != 0:
            self._popup(f"Vehicle refused the guided item: {ack.type}")
        while SET_MODE in self._outstanding:
            yield ("answer to the mode", lambda message: SET_MODE not in self._outstanding, 0.1)

    def reboot(self) -> Steps:
        """*Reboot Vehicle*: once. An acceptance closes the vehicle, and its next HEARTBEAT opens it anew; all else opens a box.

        Both generations (read in their sources).
        """
        self.press(REBOOT, 1, shows_error=False)
        ack = None
        while ack is None and REBOOT in self._outstanding:
            ack = yield ("answer to the reboot", _is_last_word_on(REBOOT), 0.1)
        if ack is None or ack.result != 0:
            self._popup("Vehicle reboot failed.")
        else:
            self._close_vehicle()

    def _close_vehicle(self) -> None:
        self.vehicle = self.mode = None
        self.armed = False
        self._outstanding.clear()

    def upload_plan(self, items: list[Any], fence: list[Any] | None = None, rally: list[Any] | None = None) -> Steps:
        """The upload button: mission, fence and rally in this order, empty ones too. Returns whether all came through."""
        whole = True
        for kind, part, name in (
            (0, items, "Mission"),
            (1, fence or [], "GeoFence"),
            (2, rally or [], "Rally Point"),
        ):
            before = len(self.report.failures)
            result = yield from self.upload(kind, part)
            if result != 0:
                whole = False
                if len(self.report.failures) == before:
                    self._popup(f"{name} transfer failed. Error: vehicle answered {result}")
        return whole

    # ---- Vehicle Setup

    def setup(self, page: str) -> bool:
        """Open a page; True when no box opens."""
        missing = [name for name in self._wanted(page) if not self._has(name)]
        if missing:
            self._popup(f"Parameters are missing from firmware ({page}): {' '.join(missing)}")
        return not missing

    def _wanted(self, page: str) -> list[str]:
        names = list(SETUP_PAGES[page])
        if "MODE1" not in self.report.params:
            names = [f"FLT{name}" if name.startswith("MODE") else name for name in names]
        return names

    def _has(self, name: str) -> bool:
        known = self.report.params
        return name in known or (name.endswith("_REV") and f"{name}ERSED" in known)

    # ---- what the client gives

    def upload(self, kind: int, items: list[Any]) -> Steps:
        raise NotImplementedError

    def send_message(self, message: Any) -> None:
        raise NotImplementedError

    def _command_long(self, command: int, *params: float, confirmation: int = 0) -> None:
        raise NotImplementedError

    def _popup(self, text: str) -> None:
        raise NotImplementedError


def _actions(generation: Generation) -> dict[str, dict[str, Any]]:
    file = "qgc/usv-actions-qgc4.json" if generation is Generation.V4 else "qgc/usv-actions.json"
    return {entry["label"]: entry for entry in json.loads(config.path(file).read_text("utf-8"))["actions"]}


def _is_last_word_on(command: int) -> Callable[[Any], bool]:
    return lambda message: message.get_type() == "COMMAND_ACK" and message.command == command and message.result != 5


def _name(command: int) -> str:
    entry = dialect.enums["MAV_CMD"].get(command)
    return entry.name if entry else str(command)
