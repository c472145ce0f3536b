"""The vessel's own process on the real firmware, in real time: killed, frozen, unplugged, stopped by the operator.

Fault rows 1, 2, 8, 11 and 64, seen at the pins. One story, so that the vessel starts only as often as it must.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest
from pymavlink import mavutil

from sitl.board import avr
from tests.e2e.sim import BIN, REPO
from tests.firmware.chip_process import Chip

LIMIT_S = 0.55
TOLERANCE_S = 0.06
"""A loaded machine, beside the deadline."""
DISARM = mavutil.mavlink.MAV_CMD_COMPONENT_ARM_DISARM
FORCE = 21196


@pytest.fixture
def chip(tmp_path):
    missing = avr.missing_packages()
    if missing and os.environ.get("REQUIRE_ALL") == "1":
        pytest.fail(f"missing packages: {' '.join(missing)}", pytrace=False)
    if missing:
        pytest.skip(f"missing packages: {' '.join(missing)}")
    avr.build("uno", "sim")
    chip = Chip(tmp_path / "board")
    yield chip
    chip.close()


class Vessel:
    """``companion run`` without sensors, and an operator with sticks on its TCP endpoint."""

    def __init__(self, folder: Path, board: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.config = folder / "vessel.toml"
        self.config.write_text(
            f'store = ""\n[operator]\ngcs_required = false\n[[sensors]]\nurl = "tcp://127.0.0.1:1"\n'
            f'[actuators]\nurl = "serial:{board}"\n[[endpoints]]\nname = "tcp"\n'
            f'url = "tcp-listen://127.0.0.1:{self.port}"\n[radio]\nurl = ""\n'
        )
        self.folder = folder
        self.starts = 0
        self.start()

    def start(self) -> None:
        self.starts += 1
        words = [BIN / "companion", "run", self.config, "--run-dir", self.folder / f"run{self.starts}"]
        with (self.folder / f"log{self.starts}").open("w") as log:
            self.process = subprocess.Popen(words, stdout=log, stderr=log, cwd=REPO)
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    break
            time.sleep(0.1)
        self.link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{self.port}", source_system=255, dialect="all")
        assert self.link.wait_heartbeat(timeout=20) is not None

    def arm(self) -> None:
        self.link.set_mode("MANUAL")
        self.link.mav.command_long_send(1, 1, DISARM, 0, 1, FORCE, 0, 0, 0, 0, 0)

    def sticks(self, seconds: float, until=lambda: False) -> None:
        """Hold the stick half ahead."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and not until():
            self.link.mav.manual_control_send(1, 0, 0, 750, 0, 0)
            self.link.recv_match(blocking=False)
            time.sleep(0.04)

    def under_way(self, chip: Chip) -> None:
        """Ask for arming, as often as it takes for the board to be ready, and steer until the pins show it."""
        for _ in range(20):
            self.arm()
            self.sticks(1.0, until=lambda: moving(chip))
            if moving(chip):
                self.sticks(0.3)
                return
        raise AssertionError(f"never under way: {chip.pulses}; {self.folder / f'log{self.starts}'}")

    def end(self) -> None:
        self.link.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.terminate()
            self.process.wait(15)


def moving(chip: Chip) -> bool:
    return all(pulse > 1600 for pulse in chip.pulses[:2])


def stays_stopped(chip: Chip, seconds: float) -> bool:
    first = len(chip.reports)
    time.sleep(seconds)
    return all(pulse == 0 or abs(pulse - 1500) < 15 for _, pulses in chip.reports[first:] for pulse in pulses)


def test_a_vessel_on_real_firmware_stops_whatever_happens_to_it(chip, tmp_path):
    vessel = Vessel(tmp_path, chip.link)
    try:
        vessel.under_way(chip)

        # Emergency stop from a ground station.
        struck_s = time.monotonic()
        vessel.link.mav.command_long_send(1, 1, DISARM, 0, 0, FORCE, 0, 0, 0, 0, 0)
        chip.wait(chip.stopped, 2.0)
        time.sleep(0.1)
        took_s = chip.stopped_after_s(struck_s)
        print(f"emergency stop: {took_s:.3f} s")
        assert took_s <= 0.12 + TOLERANCE_S
        vessel.under_way(chip)

        # The board restarts by itself: neutral, and it stays so although the sticks are held.
        chip.order("reset 300")
        chip.wait(lambda: not moving(chip), 1.0)
        vessel.sticks(2.5)
        assert stays_stopped(chip, 0.2)
        vessel.under_way(chip)

        # Frozen, and woken again: stopped in time, and only an operator brings it back.
        struck_s = time.monotonic()
        os.kill(vessel.process.pid, signal.SIGSTOP)
        chip.wait(chip.stopped, 2.0)
        time.sleep(0.3)
        took_s = chip.stopped_after_s(struck_s)
        print(f"frozen: {took_s:.3f} s")
        assert took_s <= LIMIT_S + TOLERANCE_S
        os.kill(vessel.process.pid, signal.SIGCONT)
        vessel.sticks(1.5)
        assert stays_stopped(chip, 0.2)
        vessel.under_way(chip)

        # Killed, and started again: neutral first, disarmed.
        struck_s = time.monotonic()
        vessel.process.kill()
        chip.wait(chip.stopped, 2.0)
        time.sleep(0.3)
        took_s = chip.stopped_after_s(struck_s)
        print(f"killed: {took_s:.3f} s")
        assert took_s <= LIMIT_S + TOLERANCE_S
        vessel.process.wait(5)
        vessel.link.close()
        vessel.start()
        vessel.sticks(4.0)
        assert stays_stopped(chip, 0.2)
    finally:
        vessel.end()


def test_port_pulled_and_back_under_another_name(chip, tmp_path):
    """Rows 8 and 9: the link that names the board points at a new device; neutral first, and no thrust without an operator."""
    name = tmp_path / "by-id"
    name.symlink_to(chip.link)
    vessel = Vessel(tmp_path, name)
    other = None
    try:
        vessel.under_way(chip)
        chip.process.kill()
        time.sleep(0.5)
        other = Chip(tmp_path / "other")
        name.unlink()
        name.symlink_to(other.link)
        started_s = time.monotonic()
        other.wait(lambda: any(pulses == (0, 0, 0, 0) for _, pulses in other.reports[3:]), 5.0)  # opened: it restarts
        assert time.monotonic() - started_s <= 2.5
        vessel.sticks(3.0)
        assert stays_stopped(other, 0.2)
        vessel.under_way(other)
    finally:
        vessel.end()
        if other is not None:
            other.close()
