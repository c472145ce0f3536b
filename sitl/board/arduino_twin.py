"""The actuator board in Python: same bytes, same timings, same pins as the firmware, without a chip.

Mirrors ``firmware/usv_actuator/src/board.cpp``: neutral from boot on, latch to the checked level, 500 ms silence
failsafe, interlock until both thrusters were commanded to stop, emergency-stop input, status line at 10 Hz, pulses
renewed every 20 ms. ``sitl.board.avr.AvrArduino`` offers the same methods on the simulated chip; one conformance suite
(tests/conformance/test_actuator_board.py) runs on both.
"""

from __future__ import annotations

from typing import Final

from companion.core.board.actuator_map import STOP_BAND_US, STOP_US, PulseMap, pulses_to_demand
from companion.core.board.wire import checked

from .arduino_decoder import Decoder, PulseCommand, Word

__all__ = ["ArduinoTwin", "PulseMap", "pulses_to_demand"]

Pulses = tuple[float, float, float, float]

FRAME_US: Final = 20_000
STATUS_US: Final = 100_000
SILENCE_MS: Final = 500
LEVEL0_SILENCE_MS: Final = 1000
ESTOP_FILTER_US: Final = 10_000
WATCHDOG_NEUTRAL_US: Final = 125_000
WATCHDOG_RESET_US: Final = 250_000
NO_PULSE: Final = 0.0
"""What ``pulses_us`` shows for a pin without pulses (chip in reset, boot loader)."""
TX_BYTES: Final = 160
_STATUS: Final = "#S,%s,%d,%d,%d,%d,%.0f,%.0f,%.0f,%.0f,%s,%d"  # one format, one pass
_NEUTRAL: Final[Pulses] = (STOP_US, STOP_US, STOP_US, STOP_US)


class ArduinoTwin:
    """One board. ``level1=False`` is an old sketch: no checks, no status, no failsafe, holds the last command for ever."""

    def __init__(self, level1: bool = True) -> None:
        self._level1 = level1
        self._pressed = False
        self._millivolts = 0
        self._boot(0, "P")

    def _boot(self, now_us: int, cause: str) -> None:
        self._decoder = Decoder()
        self._started_us = now_us
        self._cause = cause
        self._good = 0
        self._target = [STOP_US] * 4
        self._heard_us: int | None = None
        self._failsafe = False
        self._interlock = False
        self._stop_seen = [False, False]
        self._estop = False
        self._input_us = now_us
        self._input_seen = False
        self._silence_ms = SILENCE_MS
        self._tx = bytearray()
        self._status_due_us = now_us + STATUS_US
        self._framed_us = now_us
        """Frames up to here have begun."""
        self.pulses_us: Pulses = _NEUTRAL
        """Pulse widths at the four pins, µs; 0 = no pulse. The same object while they stay as they are."""
        self._pins_due_us: int | None = None
        """When the pins take up what has changed: the next frame. None: nothing has."""
        self._due_us = 0
        """Before this nothing happens by itself; 0: look at everything."""
        self._obeyed: PulseCommand | None = None
        """The newest command, None when something else came after it."""
        self._silent_until_us: int | None = None
        self._hung_us: int | None = None
        if self._level1:
            self._tx += b"\n"  # ends a line that the reset cut
            self._say(f"#B,1,1.0,TWIN,{cause}")

    def set_estop(self, pressed: bool) -> None:
        """Open or close the emergency-stop switch."""
        self._pressed = pressed
        self._due_us = 0

    def set_voltage(self, volts: float) -> None:
        """Supply voltage at the divider; below 1 V counts as not measured."""
        self._millivolts = round(volts * 1000) if volts >= 1.0 else 0

    def reset(self, now_us: int, boot_loader_us: int = 0) -> None:
        """Press the reset button; a boot loader keeps the pins silent for a while."""
        if boot_loader_us:
            self._silent_until_us = now_us + boot_loader_us
            self._due_us = 0
            self._tx.clear()
            self.pulses_us = (NO_PULSE, NO_PULSE, NO_PULSE, NO_PULSE)
        else:
            self._boot(now_us, "X")

    def hang(self, now_us: int) -> None:
        """Stop the program where it is; the watchdog ends that."""
        self._hung_us = now_us
        self._due_us = 0

    def receive(self, data: bytes, now_us: int) -> None:
        """Bytes arrive at the board; a board that boots or hangs loses them."""
        self._advance(now_us)
        if self._silent_until_us is not None or self._hung_us is not None:
            return
        decoder, index = self._decoder, 0
        while not decoder.strict and index < len(data):
            self._take(decoder.byte(data[index], now_us), now_us)
            index += 1
        if decoder.strict:
            for found in decoder.take_strict(data[index:]):
                self._take(found, now_us)

    def step(self, now_us: int) -> bytes:
        """Let time pass; return what the board has said since the last call."""
        self._advance(now_us)
        if not self._tx:
            return b""
        said = bytes(self._tx)
        self._tx.clear()
        return said

    def _advance(self, now_us: int) -> None:
        if now_us < self._due_us:
            self._framed_us = now_us
            return
        if self._silent_until_us is not None:
            if now_us < self._silent_until_us:
                return
            self._boot(self._silent_until_us, "X")
        if self._hung_us is not None and not self._watchdog(now_us):
            return
        if not self._decoder.strict:
            self._take(self._decoder.silence(now_us), now_us)
        if self._pressed != self._input_seen or self._pressed != self._estop:
            self._read_estop(now_us)
        self._check_silence(now_us)
        if self._pins_due_us is not None and now_us >= self._pins_due_us:
            self._pins_due_us = None
            self.pulses_us = self._applied()
        self._framed_us = now_us
        if now_us >= self._status_due_us and self._level1:
            self._status_due_us += ((now_us - self._status_due_us) // STATUS_US + 1) * STATUS_US
            self._say_status(now_us)
        self._due_us = self._next_us()

    def _next_us(self) -> int:
        """When something happens next, if nobody does anything."""
        if not self._decoder.strict or self._pressed != self._input_seen or self._pressed != self._estop:
            return 0
        due_us = self._status_due_us
        if self._pins_due_us is not None and self._pins_due_us < due_us:
            due_us = self._pins_due_us
        if self._heard_us is not None and not self._failsafe:
            silent_us = self._heard_us + self._silence_ms * 1000
            return silent_us if silent_us < due_us else due_us
        return due_us

    def _renew(self) -> None:
        """The pins change with the next frame."""
        self._pins_due_us = self._framed_us - (self._framed_us - self._started_us) % FRAME_US + FRAME_US
        self._due_us = 0

    def _watchdog(self, now_us: int) -> bool:
        """Return True when the board runs again; before that neutral, as the firmware's watchdog interrupt gives."""
        assert self._hung_us is not None
        stuck_us = now_us - self._hung_us
        if stuck_us >= WATCHDOG_RESET_US:
            self._boot(self._hung_us + WATCHDOG_RESET_US, "W")
            return True
        if stuck_us >= WATCHDOG_NEUTRAL_US:
            self.pulses_us = _NEUTRAL
        return False

    def _take(self, found: PulseCommand | Word | None, now_us: int) -> None:
        if isinstance(found, PulseCommand):
            self._command(found, now_us)
        elif isinstance(found, Word) and self._level1:
            self._word(found.text, now_us)

    def _command(self, command: PulseCommand, now_us: int) -> None:
        self._good += 1
        self._heard_us = now_us
        self._failsafe = False
        if command.checked and self._level1 and not self._decoder.strict:
            self._decoder.strict = True
            self._lock()
        if command is self._obeyed:
            return
        self._obeyed = command
        self._renew()
        target = self._target
        for pin, pulse in command.pulses:
            target[pin] = pulse
        if self._interlock:
            self._see_stops(command)

    def _see_stops(self, command: PulseCommand) -> None:
        """The interlock ends when both thrusters were commanded to stop since it began."""
        for pin, pulse in command.pulses:
            if pin < 2:
                self._stop_seen[pin] = abs(pulse - STOP_US) <= STOP_BAND_US
        if not self._estop and all(self._stop_seen):
            self._interlock = False

    def _lock(self) -> None:
        self._interlock = True
        self._stop_seen = [False, False]
        self._obeyed = None
        self._renew()

    def _word(self, text: str, now_us: int) -> None:
        if text == "#VERS?":
            self._say(f"#V,1,1.0,TWIN,{self._silence_ms}")
        elif text == "#NEUTR":
            self._command(PulseCommand(tuple((pin, STOP_US) for pin in range(4)), checked=True), now_us)
        elif text == "#ZERO0":
            self._good = self._decoder.bad = 0
        elif text[:2] == "#T" and text[2:].isdigit() and 200 <= int(text[2:]) <= 2000:
            self._silence_ms = int(text[2:])
            self._due_us = 0
        else:
            self._decoder.bad += 1

    def _read_estop(self, now_us: int) -> None:
        if not self._level1:
            return
        if self._pressed != self._input_seen:
            self._input_seen, self._input_us = self._pressed, now_us
        if self._pressed != self._estop and now_us - self._input_us >= ESTOP_FILTER_US:
            self._estop = self._pressed
            self._lock()

    def _check_silence(self, now_us: int) -> None:
        if not self._level1 or self._heard_us is None:
            return
        limit_ms = self._silence_ms if self._decoder.strict else LEVEL0_SILENCE_MS
        if now_us - self._heard_us >= limit_ms * 1000:
            self._failsafe = True
            self._target = [STOP_US] * 4
            self._obeyed = None
            self._renew()
            if self._decoder.strict:
                self._lock()

    def _applied(self) -> Pulses:
        if self._estop:
            return _NEUTRAL
        first, second, third, fourth = self._target
        return (STOP_US, STOP_US, third, fourth) if self._interlock else (first, second, third, fourth)

    def _state(self) -> str:
        if self._estop:
            return "E"
        if self._failsafe:
            return "F"
        if self._heard_us is None:
            return "B"
        if self._interlock:
            return "I"
        return "C" if self._decoder.strict else "A"

    def _say_status(self, now_us: int) -> None:
        silent_ms = 65535 if self._heard_us is None else min((now_us - self._heard_us) // 1000, 65535)
        decoder = self._decoder
        counts = (decoder.strict, silent_ms, self._good, decoder.bad)
        self._say(_STATUS % (self._state(), *counts, *self.pulses_us, self._cause, self._millivolts))

    def _say(self, body: str) -> None:
        line = checked(body)
        if len(self._tx) + len(line) <= TX_BYTES:
            self._tx += line
