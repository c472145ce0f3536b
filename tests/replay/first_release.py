"""The files that the first release left (``tests/data/first_release``), unpacked where a test wants them."""

from __future__ import annotations

import json
import lzma
from pathlib import Path

DATA = Path(__file__).resolve().parents[1] / "data" / "first_release"
RUNS = ("home/run", *sorted(path.name for path in DATA.iterdir() if path.name != "home"))
OVER_THE_RADIO = ("gateway", "home/run", "radio")
"""Runs whose orders came over the air: the wire format of then may be understood no more."""


def unpack(name: str, folder: Path) -> Path:
    """Put a store (``home/companion.db``, ``home/gateway.db``) or a run folder below ``folder``; return where it is."""
    packed = DATA / f"{name}.xz"
    if packed.is_file():
        path = folder / Path(name).name
        path.write_bytes(lzma.decompress(packed.read_bytes()))
        return path
    run_dir = folder / Path(name).name
    run_dir.mkdir()
    for packed in (DATA / name).glob("*.xz"):
        (run_dir / packed.stem).write_bytes(lzma.decompress(packed.read_bytes()))
    return run_dir


def states(run_dir: Path) -> list[str]:
    """Mode, arming, plan and reached items as the run's events tell them, in their order."""
    found = []
    for line in (run_dir / "events.jsonl").read_text().splitlines():
        event = json.loads(line)
        if event["event"] in ("mode", "armed", "plan"):
            found.append(f"{event['event']} {event['value']}")
        elif event["event"] == "reached":
            found.append(f"reached {event['item']}")
    return found
