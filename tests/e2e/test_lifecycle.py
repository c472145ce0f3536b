"""The vessel's process against a world that it does not own: killed, frozen, interrupted, misconfigured."""

from __future__ import annotations

import csv
import os
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil

from tests.e2e.sim import BIN, REPO

NEUTRAL_WITHIN_S = 0.55
FRAME_S = 0.07
"""A servo frame and the world's own step, beside the deadline."""


class Pair:
    """``companion sim --world-only`` and a ``companion run`` beside it."""

    def __init__(self, folder: Path, instance: int) -> None:
        self.run_dir = folder / "run"
        self.tcp = 5760 + 10 * instance
        words = ["sim", "--world-only", "--instance", str(instance), "--run-dir", str(self.run_dir)]
        self.log = (folder / "log").open("w")
        self.world = subprocess.Popen([BIN / "companion", *words], stdout=self.log, stderr=self.log, cwd=REPO)
        wait_until((self.run_dir / "arduino").exists, "the board's port")
        self.vessel = self.start_vessel(instance)

    def start_vessel(self, instance: int) -> subprocess.Popen[bytes]:
        move = [
            f"sensors.0.url=tcp://127.0.0.1:{3000 + 10 * instance}",
            f"endpoints.0.url=udp://127.0.0.1:{14550 + 10 * instance}",
            f"endpoints.1.url=udp://127.0.0.1:{14540 + 10 * instance}",
            f"endpoints.2.url=tcp-listen://127.0.0.1:{self.tcp}",
            "operator.gcs_required=false",
        ]
        words = ["run", "config/sim.toml", "--run-dir", str(self.run_dir)]
        for item in move:
            words += ["--set", item]
        # what runs these tests may ignore SIGHUP, as nohup does, and its children would too
        heard = ["env", "--default-signal=HUP", str(BIN / "companion")]
        return subprocess.Popen([*heard, *words], stdout=self.log, stderr=self.log, cwd=REPO)

    def pins(self) -> list[tuple[float, list[float]]]:
        with (self.run_dir / "board.csv").open() as file:
            rows = [row for row in csv.reader(file) if len(row) == 7][1:]
        return [(float(row[0]), [float(value) for value in row[1:5]]) for row in rows]

    def under_way(self) -> None:
        """Arm by MAVLink and steer by hand until the pins show thrust."""
        wait_until(lambda: _answers(self.tcp), "the vessel's TCP endpoint")
        link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{self.tcp}", source_system=255, dialect="all")
        link.wait_heartbeat(timeout=20)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and (not self.pins() or self.pins()[-1][1][0] < 1600):
            link.mav.heartbeat_send(6, 8, 0, 0, 0)
            link.set_mode("MANUAL")
            link.arducopter_arm()
            for _ in range(10):
                link.mav.manual_control_send(link.target_system, 0, 0, 800, 0, 0)
                time.sleep(0.05)
        assert self.pins()[-1][1][0] > 1600, "the vessel never got under way"
        link.close()

    def neutral_after_s(self, since_s: float) -> float:
        """Return how long after ``since_s`` all pins stood at neutral for good."""
        time.sleep(1.5)
        rows = self.pins()
        last_moving = max((at for at, pulses in rows if any(abs(pulse - 1500) > 1 for pulse in pulses)), default=0.0)
        assert rows[-1][0] > last_moving, "the pins never came to neutral"
        return next(at for at, _ in rows if at > last_moving) - since_s

    def close(self) -> None:
        for process in (self.vessel, self.world):
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.terminate()
                process.wait(15)
        self.log.close()


def _answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=0.5).close()
    except OSError:
        return False
    return True


def wait_until(condition: object, what: str, limit_s: float = 20.0) -> None:
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        if condition():  # type: ignore[operator]
            return
        time.sleep(0.05)
    raise AssertionError(f"{what} did not come in {limit_s} s")


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    made = Pair(tmp_path, 15)
    yield made
    made.close()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "frozen"])
def test_row_01_02_vessel_process_gone_pins_neutral(pair: Pair, how: signal.Signals) -> None:
    pair.under_way()
    os.kill(pair.vessel.pid, how)
    struck_s = pair.pins()[-1][0]
    took_s = pair.neutral_after_s(struck_s)
    print(f"neutral {took_s:.3f} s after {how.name}")
    assert took_s <= NEUTRAL_WITHIN_S + FRAME_S


def test_interrupt_writes_neutral_first_and_exits_0(pair: Pair) -> None:
    pair.under_way()
    pair.vessel.send_signal(signal.SIGINT)
    struck_s = pair.pins()[-1][0]
    assert pair.vessel.wait(10) == 0
    assert pair.neutral_after_s(struck_s) <= 0.3


def test_a_terminal_that_closes_stops_no_vessel_at_sea_and_ends_one_that_is_disarmed(pair: Pair) -> None:
    pair.under_way()
    link = mavutil.mavlink_connection(f"tcp:127.0.0.1:{pair.tcp}", source_system=255, dialect="all")
    link.wait_heartbeat(timeout=10)
    pair.vessel.send_signal(signal.SIGHUP)
    told = link.recv_match(
        type="STATUSTEXT", condition="STATUSTEXT.text.startswith('Terminal closed')", blocking=True, timeout=10
    )
    assert told is not None, "no station was told"
    assert pair.vessel.poll() is None
    deadline = time.monotonic() + 20
    while pair.vessel.poll() is None and time.monotonic() < deadline:
        link.arducopter_disarm()
        time.sleep(0.5)
        pair.vessel.send_signal(signal.SIGHUP)
        time.sleep(0.5)
    assert pair.vessel.wait(10) == 0
    link.close()


def run_companion(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [BIN / "companion", *words], capture_output=True, text=True, timeout=60, cwd=REPO, check=False
    )


def test_every_configuration_mistake_is_named_at_once(tmp_path: Path) -> None:
    config = tmp_path / "bad.toml"
    config.write_text(
        'vesel = "otter"\n[system]\nsystem_id = 300\n[depth]\nmin_altitude_m = "deep"\n[[sensors]]\nurl = "tpc://x"\n'
    )
    done = run_companion("check", str(config))
    assert done.returncode == 2
    for key in ("vesel", "system.system_id = 300", "depth.min_altitude_m = 'deep'"):
        assert key in done.stderr, done.stderr
    assert "Traceback" not in done.stderr


def test_a_port_in_use_is_said_plainly(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = run_companion(
            "sim",
            "--duration",
            "1",
            "--run-dir",
            str(tmp_path / "run"),
            "--instance",
            "16",
            "--set",
            f"endpoints.2.url=tcp-listen://127.0.0.1:{port - 160}",
        )
    assert done.returncode == 2, done.stderr
    assert str(port) in done.stderr
    assert "Traceback" not in done.stderr


def test_a_missing_device_is_waited_for(tmp_path: Path) -> None:
    config = tmp_path / "boat.toml"
    config.write_text(
        f'store = ""\n[[endpoints]]\nname = "gcs"\nurl = "udp://127.0.0.1:14550"\n'
        f'[[sensors]]\nurl = "serial:{tmp_path}/none"\n[actuators]\nurl = "serial:{tmp_path}/nothing"\n'
    )
    done = run_companion("run", str(config), "--duration", "1", "--run-dir", str(tmp_path / "run"))
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr


def test_a_plan_that_makes_no_sense_is_refused_with_its_item(tmp_path: Path) -> None:
    plan = tmp_path / "bad.txt"
    plan.write_text(
        "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t41.18\t-8.70\t0\t1\n1\t0\t3\t16\t0\t0\t0\t0\t95.0\t-8.70\t0\t1\n"
    )
    done = run_companion(
        "sim", "--plan", str(plan), "--start", "--speed", "max", "--duration", "5", "--run-dir", str(tmp_path / "r")
    )
    assert done.returncode == 2
    assert "item 0" in done.stderr
