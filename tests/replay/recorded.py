"""What this program makes of a telemetry log, as text that a person can read as a diff."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from companion.commands.plan.log import params_from_tlog, plan_from_tlog
from companion.io.log_file import parts_of
from companion.replay import ReplayError, replay, summary
from companion.report.flight import Flight
from companion.report.from_run import read_run
from companion.report.from_tlog import read_tlog
from companion.report.verdicts import RunLimits, judge
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode
from mavlink_bridge.plans import PlanFile

HERE = Path(__file__).resolve().parents[1] / "recorded"


def folders() -> list[Path]:
    """The repository's folder, and the one that RECORDED_LOGS names."""
    more = os.environ.get("RECORDED_LOGS")
    return [HERE, *([Path(more).expanduser()] if more else [])]


def recordings() -> list[Path]:
    """Logs and run folders that were dropped there."""
    found = [path for folder in folders() if folder.is_dir() for path in folder.iterdir()]
    return sorted(path for path in found if path.is_dir() or path.suffix == ".tlog")


def expectation(recording: Path) -> Path:
    name = recording.name.removesuffix(".tlog")
    return recording.with_name(f"{name}.expected.txt")


def told_of(recording: Path) -> str:
    """The text. Raises ValueError for what is no log and no run."""
    is_run = recording.is_dir()
    parts = parts_of(recording / "mavlink.tlog") if is_run else [recording]
    data = b"".join(part.read_bytes() for part in parts)
    what = tlog.not_a_log(data)
    if what:
        raise ValueError(f"{recording}: {what}")
    flight = read_run(recording) if is_run else read_tlog(recording)
    lines = [*_frames(data), *_flight(flight), *_plan(plan_from_tlog(data)), *_params(params_from_tlog(data))]
    if is_run and (recording / "inputs.bin").exists():
        lines += _replayed(recording)
    return "\n".join(lines) + "\n"


def _frames(data: bytes) -> Iterator[str]:
    """Every message by its sender; what cannot be judged, and bytes that belong to nothing."""
    counted: Counter[str] = Counter()
    held = unread = 0
    for found in tlog.scan(data):
        if isinstance(found, tlog.Unread):
            unread += 1
            held += 8 + found.size
            counted[f"{found.system}/{found.component} message {found.message_id}, not judged"] += 1
            continue
        held += 8 + len(found.frame.raw)
        message = decode(found.frame)
        name = message.get_type() if message is not None else f"message {found.frame.message_id}, not decoded"
        counted[f"{found.frame.system}/{found.frame.component} {name}"] += 1
    yield f"{sum(counted.values())} frames, {unread} of them not judged, {len(data) - held} bytes of damage"
    yield from (f"frames  {name}: {count}" for name, count in sorted(counted.items()))


def _flight(flight: Flight) -> Iterator[str]:
    yield f"vehicle {flight.about.get('vehicle', '-')}, {flight.duration_s:.1f} s"
    yield from (f"note    {note}" for note in flight.notes)
    yield from (f"event   {event.t_s:9.2f}  {event.kind}: {event.text}" for event in flight.events)
    for verdict in judge(flight, RunLimits()):
        yield f"verdict {verdict.name}: {verdict.value} ({verdict.limit}) {verdict.ok}"


def _plan(found: PlanFile) -> Iterator[str]:
    for name, items in (("mission", found.mission), ("fence", found.fence), ("rally", found.rally)):
        for number, item in enumerate(items):
            values = " ".join(f"{value:g}" for value in (item.param1, item.param2, item.param3, item.param4))
            yield f"{name:7} {number}: command {item.command} frame {item.frame} [{values}] {item.x} {item.y} {item.z:g}"


def _params(text: str) -> Iterator[str]:
    yield from ("param   " + line.replace("\t", " ") for line in text.splitlines() if not line.startswith("#"))


def _replayed(run_dir: Path) -> Iterator[str]:
    try:
        outcome = replay(run_dir)
    except ReplayError as error:
        yield f"replay  {str(error).replace(str(run_dir), run_dir.name)}"
        return
    yield from (f"replay  {line}" for line in summary(outcome, 0.0).splitlines() if "replayed in" not in line)
