"""The same buttons pressed by other clients: MAVSDK, which repeats each command, and MAVProxy, which says it once and waits.

MAVSDK (its public sources, and MAVSDK 4.1 as counted in gcs.md): a command is sent four times half a second apart; "in progress" puts
the next of these off by all that are left. It arms, changes mode and starts by commands, and believes the acknowledgement. MAVProxy
sends what is typed once and prints the acknowledgement whenever it comes. A command that ends as failed, refused or unanswered is
one entry of ``report.popups``, as with QGroundControl.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from mavlink_bridge.mavlink.wire.codec import dialect
from tests.qgc_buttons import ARM, AUTO, GUIDED, REPOSITION, RTL, SET_MODE, Steps
from tests.qgc_client import QgcClient

_IN_PROGRESS: Final = 5
_REPEATED_S: Final = 0.5
_TYPED_S: Final = 30.0
"""Nobody who reads a console waits longer for its line."""


@dataclass
class _Command:
    message: Any
    sends_left: int
    wait_s: float
    due_us: int


class _Console(QgcClient):
    """Connects as QGroundControl does; what is pressed goes by other rules. ``SENDS`` times, ``WAIT_S`` apart."""

    SENDS: int
    WAIT_S: float

    def __init__(self, system: int, component: int) -> None:
        super().__init__(system, component)
        self._commands: dict[int, _Command] = {}
        self._results: dict[int, int | None] = {}

    def take(self, now_us: int) -> bytes:
        for number, command in list(self._commands.items()):
            if now_us < command.due_us:
                continue
            if command.sends_left == 0:
                self._end(number, None)
                continue
            command.sends_left -= 1
            command.due_us = now_us + round(command.wait_s * 1e6)
            self.send_message(command.message)
        return super().take(now_us)

    def _answered(self, message: Any) -> None:
        command = self._commands.get(message.command)
        if command is None:
            super()._answered(message)
        elif message.result == _IN_PROGRESS:
            command.due_us = self._now_us + round(max(command.sends_left, 1) * command.wait_s * 1e6)
        else:
            self._end(message.command, message.result)

    def _end(self, number: int, result: int | None) -> None:
        del self._commands[number]
        self._results[number] = result
        if result != 0:
            self._popup(f"command {number} failed: {'no answer' if result is None else result}")

    def _ask(self, number: int, message: Any) -> Steps:
        self._commands[number] = _Command(message, self.SENDS, self.WAIT_S, self._now_us)
        while number in self._commands:
            yield (f"answer to {number}", lambda _: number not in self._commands, 0.05)
        return self._results.pop(number) == 0

    def _long(self, number: int, *params: float) -> Steps:
        assert self.vehicle is not None
        if number == SET_MODE:
            self.wants_mode = round(params[1])
        elif number == ARM:
            self.wants_armed = bool(params[0])
        values = [*params, *[0.0] * (7 - len(params))]
        return (yield from self._ask(number, dialect.MAVLink_command_long_message(self.vehicle, 1, number, 0, *values)))

    # ---- the buttons

    def mode_menu(self, number: int) -> Steps:
        return (yield from self._long(SET_MODE, 1, number))

    def start_mission(self) -> Steps:
        if not (yield from self._long(ARM, 1)):
            self._popup("failed to arm")
            return False
        return (yield from self._long(SET_MODE, 1, AUTO))

    def continue_mission(self) -> Steps:
        return (yield from self._long(SET_MODE, 1, AUTO))

    def return_home(self) -> Steps:
        return (yield from self._long(SET_MODE, 1, RTL))

    def disarm(self) -> Steps:
        return (yield from self._long(ARM, 0))

    def go_to(self, lat_e7: int, lon_e7: int) -> Steps:
        assert self.vehicle is not None
        yield from self._long(SET_MODE, 1, GUIDED)
        place = dialect.MAVLink_command_int_message(
            self.vehicle, 1, 0, REPOSITION, 0, 0, -1, 1, 0, math.nan, lat_e7, lon_e7, 0.0
        )
        return (yield from self._ask(REPOSITION, place))


class MavsdkButtons(_Console):
    """MAVSDK's rules."""

    SENDS = 4
    WAIT_S = _REPEATED_S

    def __init__(self) -> None:
        super().__init__(245, 190)


class MavproxyButtons(_Console):
    """MAVProxy's rules."""

    SENDS = 1
    WAIT_S = _TYPED_S

    def __init__(self) -> None:
        super().__init__(255, 230)
