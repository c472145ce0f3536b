"""Makes ``tests/data/*.tlog`` again: MAVSDK as the ground station of a live simulated vessel, what both said, cut to size.

``python -m tests.replay.record_tlogs``. Kept are every frame of the ground station and, of the vessel, the answers; of what it
repeats by itself one frame in five seconds each.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from companion.io.log_file import parts_of
from companion.report.from_tlog import find_vehicle
from mavlink_bridge.mavlink.wire import tlog
from tests.e2e.sim import CLIENTS, LAT_DEG, LON_DEG, REPO, Sim
from tests.replay.own_logs import DATA, REPEATED

SDK_LINK, RADIO_LINK = 1, 3
SHOAL_LAT_DEG = 41.1860932
EVERY_US = 5_000_000
HEARTBEAT = 0


def cut(log: bytes, link: int) -> bytes:
    """One link of a log, without most of what repeats; a HEARTBEAT that tells another mode stays."""
    last: dict[int, int] = {}
    beat = b""
    records = list(tlog.iterate(log))
    vehicle = find_vehicle(records)
    assert vehicle is not None
    out = bytearray()
    for record in records:
        if record.link != link:
            continue
        frame = record.frame
        if frame.system == vehicle[0] and frame.message_id in REPEATED:
            changed = frame.message_id == HEARTBEAT and frame.payload != beat
            if record.t_us - last.get(frame.message_id, 0) < EVERY_US and not changed:
                continue
            beat = frame.payload if frame.message_id == HEARTBEAT else beat
            last[frame.message_id] = record.t_us
        out += tlog.pack(record.t_us, link, frame.raw)
    return bytes(out)


def events(run_dir: Path) -> str:
    path = run_dir / "events.jsonl"
    return path.read_text() if path.exists() else ""


def record(name: str, instance: int, lat_deg: float, until: str, link: int, *, speed: float = 2.0) -> None:
    """Sail with MAVSDK until a text is in the events, and keep the log."""
    with tempfile.TemporaryDirectory() as folder:
        run_dir = Path(folder) / "run"
        with Sim(run_dir, instance, speed, ("--set", "operator.gcs_required=false")) as sim:
            url = f"udpin://0.0.0.0:{sim.port(14540)}" if link == SDK_LINK else f"serial://{run_dir}/lora:9600"
            more = [] if link == SDK_LINK else ["ardurover"]
            words = [sys.executable, CLIENTS / "mavsdk_loiter.py", url, str(lat_deg), str(LON_DEG), "20", *more]
            environment = {**os.environ, "PYTHONPATH": str(REPO)}
            client = subprocess.Popen(words, cwd=REPO, env=environment, stdout=subprocess.DEVNULL)
            deadline = time.monotonic() + 240
            while time.monotonic() < deadline and until not in events(run_dir):
                time.sleep(0.5)
            time.sleep(3.0)
            client.kill()
            client.wait()
        log = (run_dir / "mavlink.tlog").read_bytes()
    data = cut(log, link)
    DATA.mkdir(exist_ok=True)
    (DATA / f"{name}.tlog").write_bytes(data)
    print(name, len(data), "bytes")


def live(client: str, persona: str) -> bytes:
    """What a real client and a simulated vessel said to each other over a loiter, cut to size."""
    link, base = (0, 14550) if persona == "ardurover" else (SDK_LINK, 14540)
    with tempfile.TemporaryDirectory() as folder:
        run_dir = Path(folder) / "run"
        with Sim(run_dir, 54, 2.0, ("--set", "operator.gcs_required=false")) as sim:
            url = f"udpin:0.0.0.0:{sim.port(base)}" if client == "mavproxy" else f"udpin://0.0.0.0:{sim.port(base)}"
            more = [folder, persona] if client == "mavproxy" else [persona] * (persona == "ardurover")
            words = [sys.executable, CLIENTS / f"{client}_loiter.py", url, str(LAT_DEG), str(LON_DEG), "15", *more]
            environment = {**os.environ, "PYTHONPATH": str(REPO)}
            talk = subprocess.Popen(words, cwd=REPO, env=environment, stdout=subprocess.DEVNULL)
            deadline = time.monotonic() + 240
            while time.monotonic() < deadline and talk.poll() is None and "plan complete" not in events(run_dir):
                time.sleep(0.5)
            time.sleep(3.0)
            talk.kill()
            talk.wait()
        log = b"".join(part.read_bytes() for part in parts_of(run_dir / "mavlink.tlog"))
    return cut(log, link)


def main() -> None:
    """Record all, or those named."""
    wanted = sys.argv[1:]
    if not wanted or "loiter-mavsdk" in wanted:
        record("loiter-mavsdk", 51, LAT_DEG, "plan complete", SDK_LINK)
    if not wanted or "guard-stop-mavsdk" in wanted:
        record("guard-stop-mavsdk", 52, SHOAL_LAT_DEG, '"action", "value": "STOP"', SDK_LINK)
    if not wanted or "lora-plan-mavsdk" in wanted:
        record("lora-plan-mavsdk", 53, LAT_DEG, "plan complete", RADIO_LINK, speed=1.0)


if __name__ == "__main__":
    main()
