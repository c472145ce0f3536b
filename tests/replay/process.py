"""Small recorded runs and what the program made of them, as text that a person can read as a diff.

``recordings/NAME.bin.xz`` is a run's inputs; ``recordings/NAME.txt`` the expectation: one line for each second, and every change.
"""

from __future__ import annotations

import lzma
import math
from collections.abc import Callable
from pathlib import Path

from companion.replay import ReplayOutcome, replay
from mavlink_bridge.language.snapshot import Snapshot

RECORDINGS = Path(__file__).parent / "recordings"


def names() -> list[str]:
    return sorted(path.name.removesuffix(".bin.xz") for path in RECORDINGS.glob("*.bin.xz"))


def keep(name: str, run_dir: Path) -> None:
    """Put a run's inputs among the recordings."""
    RECORDINGS.mkdir(exist_ok=True)
    data = (run_dir / "inputs.bin").read_bytes()
    (RECORDINGS / f"{name}.bin.xz").write_bytes(lzma.compress(data, preset=9 | lzma.PRESET_EXTREME))


def run(name: str, folder: Path) -> tuple[str, ReplayOutcome]:
    """Replay a recording through today's program; return the text of what it did."""
    (folder / "inputs.bin").write_bytes(lzma.decompress((RECORDINGS / f"{name}.bin.xz").read_bytes()))
    lines: list[str] = []
    outcome = replay(folder, on_tick=_writer(lines))
    return "\n".join(lines) + "\n", outcome


def _writer(lines: list[str]) -> Callable[[Snapshot], None]:
    last: list[tuple[str, ...]] = [()]

    def write(s: Snapshot) -> None:
        at = f"{s.t_us / 1e6:8.2f}"
        lines.extend(f"{at}  reached item {seq}" for seq in s.progress.reached)
        lines.extend(f"{at}  {text.severity.name.lower()}: {text.text}" for text in s.texts)
        state = (
            s.mode.value,
            "armed" if s.armed else "disarmed",
            s.progress.state.name.lower(),
            f"item {s.progress.seq}",
            f"guard {s.guard.name.lower()}",
            f"{s.action.name.lower()} {' '.join(s.causes)}".strip(),
            s.output.cause,
        )
        if state != last[0]:
            last[0] = state
            lines.append(f"{at}  {', '.join(state)}")
        if s.t_us % 1_000_000 == 0:
            lines.append(f"{at}  {_figures(s)}")

    return write


def _figures(s: Snapshot) -> str:
    state, out = s.state, s.output
    where = "x - y -" if state.x_m is None or state.y_m is None else f"x {state.x_m:7.2f} y {state.y_m:7.2f}"
    heading = "-" if state.psi_rad is None else f"{math.degrees(state.psi_rad) % 360:5.1f}"
    speed = "-" if state.sog_mps is None else f"{state.sog_mps:4.2f}"
    xte = "-" if s.path.cross_track_m is None else f"{s.path.cross_track_m:5.2f}"
    water = "-" if state.alt_m is None else f"{state.alt_m:5.2f}"
    return (
        f"{where}  hdg {heading} sog {speed} xte {xte} water {water}  "
        f"thrust {out.thruster_port:5.2f} {out.thruster_starboard:5.2f} rudder {math.degrees(out.rudder_port_rad):5.1f}"
    )
