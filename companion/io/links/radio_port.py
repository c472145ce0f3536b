"""A radio module's serial port in configuration mode: its pins, its timing, one question and one answer at a time."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Final, Literal

import serial

from mavlink_bridge.radio.air.module import (
    BAUD,
    FACTORY_RESET,
    READ_BLOCK,
    READ_MODEL,
    ModuleError,
    check_block,
    check_model,
    read_line,
    write_command,
)

SET_LOW_S: Final = 0.2
SET_HIGH_S: Final = 0.1
_ANSWER_S: Final = 1.0
_QUIET_S: Final = 0.1
SIMULATED_SET: Final = ".set"
"""A simulated module's SET is low while the file of its port's name and this ending is there."""
_GPIO: Final = Path("/sys/class/gpio")
How = Literal["hand", "rts", "dtr"] | str


class ModulePort:
    """Opens the port at 9600 8N1, brings SET low as ``set_by`` says, and lets it go at the end.

    ``set_by``: 'hand' asks the operator by ``prompt``, 'rts' and 'dtr' use the adapter's lines (asserted = low), 'gpio:N' a pin of this
    computer, 'sim' the pin of a simulated module (a file beside its port), 'none' finds the module in configuration mode
    already. Raises ModuleError.
    """

    def __init__(self, path: str, set_by: How = "hand", prompt: Callable[[str], object] = input) -> None:
        self._set_by = set_by
        self._path = path
        self._prompt = prompt
        try:
            self._port = serial.Serial(path, BAUD, timeout=_QUIET_S, write_timeout=_ANSWER_S)
        except (OSError, ValueError, serial.SerialException) as error:
            raise ModuleError(f"{path}: {error}") from None

    def __enter__(self) -> ModulePort:
        self._pin(low=True)
        time.sleep(SET_LOW_S)
        self._port.reset_input_buffer()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pin(low=False)
        time.sleep(SET_HIGH_S)
        self._port.close()

    def model(self) -> str:
        return check_model(self._ask(READ_MODEL))

    def block(self) -> bytes:
        answer = self._ask(READ_BLOCK)
        block = read_line(answer)
        if block is None:
            raise ModuleError(f"the settings did not come whole ({len(answer)} bytes)")
        return check_block(block)

    def write(self, block: bytes) -> None:
        """Write a whole block, then read it back. Raises ModuleError when the module has something else."""
        self._accepted(write_command(check_block(block)), "the settings")
        if self.block() != block:
            raise ModuleError("the module read back other settings than were written")

    def reset(self) -> None:
        self._accepted(FACTORY_RESET, "the factory reset")

    def _accepted(self, command: bytes, what: str) -> None:
        answer = self._ask(command)
        if read_line(answer) != b"OK":
            raise ModuleError(f"the module refused {what}: {answer[:20]!r}")

    def _ask(self, command: bytes) -> bytes:
        """Send a command and read until the module is silent; settings may hold bytes that look like a line's end."""
        try:
            self._port.write(command)
            deadline = time.monotonic() + _ANSWER_S
            answer = b""
            while time.monotonic() < deadline:
                chunk = bytes(self._port.read(256))
                if not chunk and answer:
                    break
                answer += chunk
        except (OSError, serial.SerialException) as error:
            raise ModuleError(str(error)) from None
        return answer

    def _pin(self, *, low: bool) -> None:
        if self._set_by == "hand":
            level = "low (configuration)" if low else "high (work)"
            self._prompt(f"Bring the module's SET pin {level}, CS high or open, then press Enter: ")
        elif self._set_by == "rts":
            self._port.rts = low
        elif self._set_by == "dtr":
            self._port.dtr = low
        elif self._set_by == "sim":
            _simulated(Path(f"{self._path}{SIMULATED_SET}"), low=low)
        elif self._set_by.startswith("gpio:"):
            _gpio(self._set_by.removeprefix("gpio:"), high=not low)


def _simulated(pin: Path, *, low: bool) -> None:
    try:
        pin.touch() if low else pin.unlink(missing_ok=True)
    except OSError as error:
        raise ModuleError(f"{pin}: {error.strerror}") from None


def _gpio(number: str, *, high: bool) -> None:
    pin = _GPIO / f"gpio{number}"
    try:
        if not pin.exists():
            (_GPIO / "export").write_text(number)
        (pin / "direction").write_text("high" if high else "low")
    except OSError as error:
        raise ModuleError(f"gpio {number}: {error}") from None
