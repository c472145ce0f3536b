"""The simulated chip in a process of its own, on a pty, with every report of its pins."""

from __future__ import annotations

import subprocess
import threading
import time

from sitl.board import avr

BOOT_LOADER_MS = 300


class Chip:
    """``chip_pty`` in the background; keeps every report of the pins."""

    def __init__(self, link, boot_loader_ms=BOOT_LOADER_MS):
        self.link = link
        words = [avr.BUILD / "chip_pty", avr.BUILD / "uno.elf", "atmega328p", link, str(boot_loader_ms)]
        self.process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.reports = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.wait(lambda: link.is_symlink() and bool(self.reports), 5.0)

    def _read(self):
        for line in self.process.stdout:
            stamp, *pulses = line.split()
            self.reports.append((int(stamp) * 1e-6, tuple(map(float, pulses))))

    def order(self, text):
        self.process.stdin.write(text + "\n")

    @property
    def pulses(self):
        return self.reports[-1][1]

    def wait(self, condition, limit_s):
        end = time.monotonic() + limit_s
        while not condition():
            assert time.monotonic() < end, f"not in {limit_s} s; last report {self.reports[-1:]}"
            time.sleep(0.005)

    def thrusting(self):
        return all(abs(pulse - 1700) < 15 for pulse in self.pulses[:2])

    def stopped(self):
        return all(abs(pulse - 1500) < 15 for pulse in self.pulses)

    def stopped_after_s(self, since_s):
        """Seconds from ``since_s`` until the pins were neutral for good."""
        moving = [at for at, pulses in self.reports if any(abs(pulse - 1500) >= 15 for pulse in pulses)]
        later = [at for at, _ in self.reports if at > moving[-1]]
        return later[0] - since_s

    def close(self):
        self.process.stdin.close()
        self.process.wait(5)
        self._reader.join(5)
        self.process.stdout.close()
