"""The real firmware on a simulated AVR, in lock step: the same methods as ``ArduinoTwin``, and pulses measured at the pins.

Loads ``build/firmware/libchip.so`` (libsimavr, test use only) and the firmware's ELF file; ``make -C firmware``
builds both. Simulated time follows ``now_us`` exactly: nothing here looks at a clock.
"""

from __future__ import annotations

import ctypes
import fcntl
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path
from typing import Final, Literal

from companion.core.board.wire import checked
from companion.settings import ConfigError

from .arduino_twin import ArduinoTwin, Pulses

REPO: Final = Path(__file__).resolve().parents[2]
FIRMWARE: Final = REPO / "firmware"
BUILD: Final = REPO / "build" / "firmware"
MCU: Final = {"uno": "atmega328p", "mega": "atmega2560"}
CYCLES_PER_US: Final = 16
DIVIDER: Final = 5.0
"""Supply voltage over voltage at the pin, as the firmware is built."""
PACKAGES: Final = {
    "make": ("make",),
    "gcc-avr": ("avr-g++",),
    "binutils-avr": ("avr-objcopy",),
    "gcc": ("cc",),
}
FILES: Final = {
    "arduino-core-avr": Path("/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h"),
    "avr-libc": Path("/usr/lib/avr/include/avr/io.h"),
    "libsimavr-dev": Path("/usr/include/simavr/sim_avr.h"),
}


class FirmwareUnavailableError(ConfigError):
    """The firmware or the chip simulator cannot be built here; the text names what to install."""

    def __init__(self, text: str) -> None:
        super().__init__("world.arduino", [text])


class Pulse(ctypes.Structure):
    """One pulse as measured at a pin; cycles of 1/16 µs."""

    _fields_ = (("rise_cycles", ctypes.c_uint64), ("width_cycles", ctypes.c_uint32), ("pin", ctypes.c_uint32))

    rise_cycles: int
    width_cycles: int
    pin: int

    @property
    def rise_us(self) -> float:
        return self.rise_cycles / CYCLES_PER_US

    @property
    def width_us(self) -> float:
        return self.width_cycles / CYCLES_PER_US


def make_board(kind: Literal["twin", "firmware"]) -> ArduinoTwin | AvrArduino:
    """Return the board that ``world.arduino`` names. Raises FirmwareUnavailableError."""
    return AvrArduino() if kind == "firmware" else ArduinoTwin()


def missing_packages() -> list[str]:
    """Return the Debian packages that building firmware and chip simulator needs and this machine lacks."""
    tools = [name for name, programs in PACKAGES.items() if not all(shutil.which(program) for program in programs)]
    return tools + [name for name, path in FILES.items() if not path.exists()]


@lru_cache(maxsize=16)
def build(*targets: str) -> None:
    """Build firmware targets (``uno``, ``mega``, ``sim`` ...), once for each process. Raises FirmwareUnavailableError."""
    if not (FIRMWARE / "Makefile").exists():
        raise FirmwareUnavailableError("the firmware's source is not here: run from a checkout of the repository")
    if missing := missing_packages():
        raise FirmwareUnavailableError(f"install {' '.join(missing)} (apt-get install ...), then try again")
    BUILD.mkdir(parents=True, exist_ok=True)
    with (BUILD / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # test workers build the same files
        words = ["make", "-s", "-C", str(FIRMWARE), *targets]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise FirmwareUnavailableError(f"make -C firmware {' '.join(targets)} failed: {done.stderr.strip()[-500:]}")


class AvrArduino:
    """One simulated board. ``variant`` names a build, e.g. 'uno' or 'mega', or 'uno_hang' with its test words."""

    def __init__(self, variant: str = "uno", *, elf: Path | None = None) -> None:
        board: Literal["uno", "mega"] = "mega" if variant.startswith("mega") else "uno"
        if elf is None:
            build(variant, "sim")
            elf = BUILD / f"{variant}.elf"
        self._library = _load()
        self._chip = self._library.chip_new(str(elf).encode(), MCU[board].encode())
        if not self._chip:
            raise FirmwareUnavailableError(f"the chip simulator cannot load {elf}")
        self.elf = elf
        self._start_us: int | None = None

    def close(self) -> None:
        """Free the chip; may be called twice."""
        if self._chip:
            self._library.chip_free(self._chip)
            self._chip = None

    def __del__(self) -> None:
        if getattr(self, "_chip", None):
            self.close()

    def receive(self, data: bytes, now_us: int) -> None:
        """Bytes reach the board's serial line, one after another at 115200 baud from now on."""
        self._run(now_us)
        self._library.chip_feed(self._chip, data, len(data))

    def step(self, now_us: int) -> bytes:
        """Let time pass; return what the board has said since the last call."""
        self._run(now_us)
        room = ctypes.create_string_buffer(16384)
        count = self._library.chip_read(self._chip, room, len(room))
        return room.raw[:count]

    def _run(self, now_us: int) -> None:
        if self._start_us is None:
            self._start_us = now_us
        if self._library.chip_run(self._chip, now_us - self._start_us):
            raise RuntimeError("the simulated chip crashed")

    @property
    def pulses_us(self) -> Pulses:
        """Last finished pulse at each pin, µs; 0 when there was none for 60 ms."""
        first, second, third, fourth = (self._library.chip_width(self._chip, pin) / CYCLES_PER_US for pin in range(4))
        return first, second, third, fourth

    def take_pulses(self) -> list[Pulse]:
        """Return every pulse finished since the last call (the last 1024 at most), oldest first.

        ``rise_us`` counts from the first ``receive`` or ``step``.
        """
        room = (Pulse * 1024)()
        count = self._library.chip_take_pulses(self._chip, room, len(room))
        return list(room[:count])

    def set_estop(self, pressed: bool) -> None:
        """Open or close the emergency-stop switch (open = stop)."""
        self._library.chip_stop(self._chip, int(pressed))

    def set_voltage(self, volts: float) -> None:
        """Supply voltage before the divider."""
        self._library.chip_millivolts(self._chip, round(volts * 1000 / DIVIDER))

    def reset(self, now_us: int, boot_loader_us: int = 0) -> None:
        """Press the reset button; a boot loader keeps the chip busy and its pins floating for a while."""
        self._run(now_us)
        self._library.chip_reset(self._chip, boot_loader_us)

    def hang(self, now_us: int) -> None:
        """Hang the program (only builds with test words: '..._hang')."""
        self.receive(checked("#HANG1"), now_us)

    def poke(self, address: int, data: bytes) -> None:
        """Write data memory."""
        for offset, byte in enumerate(data):
            self._library.chip_poke(self._chip, address + offset, byte)

    def symbol(self, name: str) -> int:
        """Return the data address of a variable of the firmware. Raises KeyError."""
        table = subprocess.run(["avr-nm", str(self.elf)], capture_output=True, text=True, check=True).stdout
        for line in table.splitlines():
            if line.endswith(f" {name}"):
                return int(line.split()[0], 16) & 0xFFFF
        raise KeyError(name)


def _load() -> ctypes.CDLL:
    library = ctypes.CDLL(str(BUILD / "libchip.so"))
    chip, size = ctypes.c_void_p, ctypes.c_size_t
    library.chip_new.argtypes, library.chip_new.restype = [ctypes.c_char_p, ctypes.c_char_p], chip
    library.chip_free.argtypes, library.chip_free.restype = [chip], None
    library.chip_run.argtypes, library.chip_run.restype = [chip, ctypes.c_uint64], ctypes.c_int
    library.chip_feed.argtypes, library.chip_feed.restype = [chip, ctypes.c_char_p, size], size
    library.chip_read.argtypes, library.chip_read.restype = [chip, ctypes.c_char_p, size], size
    library.chip_take_pulses.argtypes, library.chip_take_pulses.restype = [chip, ctypes.POINTER(Pulse), size], size
    library.chip_width.argtypes, library.chip_width.restype = [chip, ctypes.c_int], ctypes.c_uint32
    library.chip_reset.argtypes, library.chip_reset.restype = [chip, ctypes.c_uint64], None
    library.chip_stop.argtypes, library.chip_stop.restype = [chip, ctypes.c_int], None
    library.chip_millivolts.argtypes, library.chip_millivolts.restype = [chip, ctypes.c_uint], None
    library.chip_poke.argtypes, library.chip_poke.restype = [chip, ctypes.c_uint16, ctypes.c_uint8], None
    return library
