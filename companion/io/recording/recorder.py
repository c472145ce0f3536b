"""The recorder: one run, one directory, everything needed to see or repeat what happened.

``run.json`` what ran, ``mavlink.tlog`` every MAVLink frame in both directions, ``inputs.bin`` the recorded inputs,
``events.jsonl`` what changed, ``control.csv`` one row for each tick. Bytes are flushed every second; a power cut costs
at most that. It never raises and never makes the loop wait; its troubles come out as texts.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.messages import ActuatorDemand, EstimatedState, Severity
from mavlink_bridge.language.snapshot import Snapshot
from mavlink_bridge.language.traffic import NO_TRAFFIC

from ..log_file import CLOSE_WAIT_S, EAGER_FLUSH, FILE_MODE, LogFile, make_own_folder, sync_folder
from ..whole_file import whole_file
from ..writer import Writer
from . import digests
from .input_recorder import InputRecorder
from .run_folders import hold
from .traffic_log import TrafficLog

CONTROL_COLUMNS: Final = (
    "t_s,tick,mode,armed,plan_state,item,action,guard,cause,"
    "heading_deg,heading_ref_deg,heading_error_deg,heading_p,heading_i,heading_d,"
    "speed_mps,speed_ref_mps,speed_error_mps,speed_p,speed_i,speed_d,"
    "yaw_rate_dps,sog_mps,lat_deg,lon_deg,cross_track_m,distance_m,orbit_radius_m,on_path,"
    "altitude_m,altitude_raw_m,altitude_limit_m,"
    "demand_thruster_port,demand_thruster_starboard,demand_rudder_port_deg,demand_rudder_starboard_deg,"
    "thruster_port,thruster_starboard,rudder_port_deg,rudder_starboard_deg,"
    "us_thruster_port,us_thruster_starboard,us_rudder_port,us_rudder_starboard,"
    "fix_n_mps,fix_e_mps,fix_age_s"
)
_COLUMNS: Final = CONTROL_COLUMNS.count(",") + 1
CONTROL_WIDTHS: Final = (_COLUMNS, _COLUMNS - 3)
"""Fields of a row: today's, and of runs that were recorded before the fixes were."""
_FLUSH_US: Final = 1_000_000
_SPACE_US: Final = 5_000_000
_DEG: Final = 180.0 / math.pi
SHARES: Final = 16
"""A file goes on in a new part at this share of the run's limit; the inputs, needed from their start, may take half."""
_PART: Final = re.compile(r"-\d{3,}\.\w+$")
_NO_DEMAND: Final = ActuatorDemand(0)


class Recorder:
    """Writes one run directory. ``writer`` None writes at once, as a simulation wants.

    ``max_mb`` bounds the run's files together, the oldest parts go first; recording pauses while the disk has less
    than ``free_floor_mb`` free.
    """

    def __init__(
        self,
        run_dir: Path,
        *,
        max_mb: int = 512,
        free_floor_mb: int = 200,
        writer: Writer | None = None,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        self.run_dir = run_dir
        self._max_bytes = max_mb << 20
        self._floor_bytes = free_floor_mb << 20
        self.writer = self._writer = writer
        """The process's helper thread, if any."""
        self.texts: list[tuple[Severity, str]] = []
        """For the operator, since ``drain_texts``."""
        self._first_fault = ""
        self._about = dict(about or {})
        self._last: tuple[Any, ...] = ()
        self._labels = ""
        self._traffic = TrafficLog()
        self._flush_us = 0
        self._space_us = 0
        self._low = False
        self._low_found = False
        self._gone_found = False
        with self._guarded():
            make_own_folder(run_dir)
            set_aside(run_dir)
            write_json(run_dir / "run.json", self._about)
        self._hold = hold(run_dir)
        limit = self._max_bytes // SHARES
        self._tlog = self._file("mavlink.tlog", max_bytes=limit)
        self._events = self._file("events.jsonl", max_bytes=limit)
        self._control = self._file("control.csv", header=CONTROL_COLUMNS.encode() + b"\n", max_bytes=limit)
        self._inputs = self._file("inputs.bin", max_bytes=limit * SHARES // 2, stop_at_end=True)
        self.inputs = InputRecorder(self._inputs.add, self._inputs.begin)
        """Records the inputs of the app that this run is about, once started."""
        self.frames: Callable[[bytes], None] = self._tlog.add
        """Takes records for the telemetry log (``mavlink_bridge.mavlink.wire.tlog``)."""
        self._files: tuple[LogFile, ...] = (self._tlog, self._events, self._control, self._inputs)

    def _file(self, name: str, **options: Any) -> LogFile:
        return LogFile(self.run_dir / name, self._writer, self._report, **options)

    def _guarded(self) -> contextlib.AbstractContextManager[None]:
        return _Guard(self._report)

    def _report(self, text: str) -> None:
        self._first_fault = self._first_fault or text
        if len(self.texts) < 100:
            self.texts.append((Severity.WARNING, f"Recorder: {text}"))

    def tell(self, severity: Severity, text: str) -> None:
        """A text for the operator that came from beside the run's inputs: it becomes one of them."""
        if len(self.texts) < 100:
            self.texts.append((severity, text))

    def drain_texts(self) -> list[tuple[Severity, str]]:
        """Texts for the operator since the last call."""
        texts, self.texts = self.texts, []
        return texts

    @property
    def healthy(self) -> bool:
        """True while everything offered is being kept."""
        return not self._low and not any(file._fault for file in self._files)

    def missing(self) -> str:
        """What of this run is not on the disk, and why, in words; "" when all of it is. Asked after ``close``."""
        return self._lost([] if (self.run_dir / "run.json").exists() else ["run.json"])

    def _lost(self, more: Sequence[str] = ()) -> str:
        lost = [*more, *(file.first.name for file in self._files if file.dropped)]
        return f"{', '.join(lost)} ({self._first_fault or 'deleted'})" if lost else ""

    def extra(self, name: str, header: bytes = b"") -> LogFile:
        """One more file of this run, flushed with the others; ``add`` bytes to it (truth.csv of a simulation)."""
        file = self._file(name, header=header, max_bytes=self._max_bytes // SHARES)
        self._files = (*self._files, file)
        return file

    def event(self, t_us: int, kind: str, **fields: Any) -> None:
        """Keep something that happened, as one line of JSON."""
        line = json.dumps({"t_s": round(t_us / 1e6, 6), "event": kind, **fields}, default=str, ensure_ascii=False)
        self._events.add(line.encode() + b"\n")

    def tick(self, snapshot: Snapshot) -> None:
        """Keep one tick: its control row and what changed since the last; flush what is due."""
        changed = _watched(snapshot)
        if changed != self._last or snapshot.texts or snapshot.progress.reached:
            self._note_changes(snapshot, changed)
            self._labels = _labels(snapshot)
        if snapshot.traffic is not NO_TRAFFIC:
            for fields in self._traffic.changes(snapshot):
                self.event(snapshot.t_us, "vessel", **fields)
        self._control.add(_row(snapshot, self._labels))
        if snapshot.t_us >= self._flush_us or self._inputs.waiting > EAGER_FLUSH:
            self.flush(snapshot.t_us)

    def _note_changes(self, snapshot: Snapshot, changed: tuple[Any, ...]) -> None:
        t_us = snapshot.t_us
        for index, name in enumerate(_WATCHED):
            before = self._last[index] if self._last else None
            if changed[index] != before:
                self.event(t_us, name, value=_plain(changed[index]), before=_plain(before))
        self._last = changed
        for seq in snapshot.progress.reached:
            self.event(t_us, "reached", item=seq)
        for text in snapshot.texts:
            self.event(t_us, "text", severity=text.severity.name, text=text.text)

    def flush(self, now_us: int) -> None:
        """Hand everything over to the disk."""
        self._flush_us = now_us + _FLUSH_US
        if now_us >= self._space_us:
            self._space_us = now_us + _SPACE_US
            if self._writer is None:
                self._look_at_disk()
            else:
                self._writer.post(self._look_at_disk)  # not taken: the disk hangs, and looking at it would too
        if self._low != self._low_found:
            self._low = self._low_found
            floor = self._floor_bytes >> 20
            self._report(f"less than {floor} MB free: recording paused" if self._low else "room again: recording")
            for file in self._files:
                file.off = self._low
        if self._gone_found:
            self._gone_found = False
            self._report("files of this run are gone: begun anew")
        for file in self._files:
            file.flush(now_us)

    def _look_at_disk(self) -> None:
        with contextlib.suppress(OSError):
            self._begin_again()
        with contextlib.suppress(OSError):
            found = os.statvfs(self.run_dir)
            self._low_found = found.f_bavail * found.f_frsize < self._floor_bytes
        if any(file.part for file in self._files):
            with contextlib.suppress(OSError):
                drop_oldest_parts(self.run_dir, self._max_bytes, [file.path for file in self._files])

    def _begin_again(self) -> None:
        """Nobody hears of a deleted file: writing to it goes on without an error."""
        about = self.run_dir / "run.json"
        lost = not about.exists()
        for file in self._files:
            lost |= file.begin_again()
        if lost:
            make_own_folder(self.run_dir)
            write_json(about, self._about)
            self._gone_found = True
            if self._hold is not None:
                os.close(self._hold)
            self._hold = hold(self.run_dir)

    def close(self, now_us: int, **result: Any) -> None:
        """Write the rest; ``result`` is added to run.json."""
        for file in self._files:
            file.close(now_us)
        self._about.update(result)
        if self._hold is not None:
            os.close(self._hold)
            self._hold = None
        if self._writer is None or not self._writer.post(self._sum_up, CLOSE_WAIT_S):
            self._sum_up()

    def _sum_up(self) -> None:
        """Write into run.json what the files are now: a bit that flips later is seen by a replay. For the writer's thread."""
        if lost := self._lost():
            self._about[digests.MISSING] = lost
        with self._guarded():
            write_json(
                self.run_dir / "run.json", {**self._about, digests.KEY: digests.digests_of(self._files, self._about)}
            )


class _Guard(contextlib.AbstractContextManager[None]):
    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> bool:
        if isinstance(error, OSError):
            self._report(error.strerror or str(error))
            return True
        return False


_RUN_FILES: Final = ("run.json", "inputs.bin", "mavlink*.tlog", "events*.jsonl", "control*.csv", "truth*.csv")


def set_aside(run_dir: Path) -> None:
    """Move an earlier run's files into ``earlier-N``: two runs in one file could be neither replayed nor reported."""
    if not any((run_dir / name).exists() for name in ("run.json", "inputs.bin")):
        return
    found = [path for name in _RUN_FILES for path in sorted(run_dir.glob(name))]
    number = 1
    while (place := run_dir / f"earlier-{number}").exists():
        number += 1
    make_own_folder(place)
    for path in found:
        path.rename(place / path.name)


def drop_oldest_parts(run_dir: Path, limit: int, spared: Collection[Path] = ()) -> None:
    """Delete rotated parts, oldest first, until the run's files are below ``limit`` bytes. First parts stay, and those ``spared``."""
    sizes = {path: path.stat() for path in run_dir.iterdir() if path.is_file()}
    total = sum(found.st_size for found in sizes.values())
    parts = sorted(
        (found.st_mtime_ns, path) for path, found in sizes.items() if _PART.search(path.name) and path not in spared
    )
    for _, path in parts:
        if total <= limit:
            return
        total -= sizes[path].st_size
        path.unlink(missing_ok=True)


_WATCHED: Final = (
    "mode",
    "armed",
    "plan",
    "item",
    "action",
    "causes",
    "guard",
    "output",
    "fence_breached",
    "terminated",
)


def _watched(s: Snapshot) -> tuple[Any, ...]:
    progress = s.progress
    return (
        s.mode,
        s.armed,
        progress.state,
        progress.seq,
        s.action,
        s.causes,
        s.guard,
        s.output.cause,
        s.fence.breached,
        s.terminated,
    )


def _plain(value: Any) -> Any:
    return getattr(value, "name", value)


_NAN: Final = math.nan
_NUMBERS: Final = ",".join(["%.3f", "%d", "%%s", *["%.6g"] * 14, "%.8f", "%.8f", *["%.6g"] * 3, "%d", *["%.6g"] * 11])
"""One format for all numbers of a row: one pass costs a third less than a field at a time."""
_PULSES: Final = ",".join(["%d"] * 4)


def control_row(s: Snapshot) -> bytes:
    """One line of control.csv (columns: CONTROL_COLUMNS); unknown is empty."""
    return _row(s, _labels(s))


def _labels(s: Snapshot) -> str:
    """The columns that are words; they change only when something happens."""
    plan = s.progress
    return f"{s.mode.value},{s.armed:d},{plan.state:d},{plan.seq},{s.action.name},{s.guard.name},{s.output.cause}"


def _row(s: Snapshot, labels: str) -> bytes:
    state, trace, path, out = s.state, s.trace, s.path, s.output
    wish = s.demand or _NO_DEMAND
    numbers = _NUMBERS % (
        s.t_us / 1e6,
        s.tick,
        _NAN if (v := state.psi_rad) is None else v * _DEG,
        _NAN if (v := trace.psi_ref_rad) is None else v * _DEG,
        _NAN if (v := trace.heading_error_rad) is None else v * _DEG,
        trace.heading_p,
        trace.heading_i,
        trace.heading_d,
        _NAN if (v := state.u_mps) is None else v,
        _NAN if (v := trace.speed_ref_mps) is None else v,
        _NAN if (v := trace.speed_error_mps) is None else v,
        trace.speed_p,
        trace.speed_i,
        trace.speed_d,
        _NAN if (v := state.r_radps) is None else v * _DEG,
        _NAN if (v := state.sog_mps) is None else v,
        _NAN if (v := state.lat_rad) is None else v * _DEG,
        _NAN if (v := state.lon_rad) is None else v * _DEG,
        _NAN if (v := path.cross_track_m) is None else v,
        _NAN if (v := path.distance_m) is None else v,
        _NAN if (v := path.orbit_radius_m) is None else v,
        path.on_path,
        _NAN if (v := state.alt_m) is None else v,
        _NAN if (v := s.altitude_raw_m) is None else v,
        _NAN if (v := s.altitude_limit_m) is None else v,
        wish.thruster_port,
        wish.thruster_starboard,
        wish.rudder_port_rad * _DEG,
        wish.rudder_starboard_rad * _DEG,
        out.thruster_port,
        out.thruster_starboard,
        out.rudder_port_rad * _DEG,
        out.rudder_starboard_rad * _DEG,
    )
    pulses = _PULSES % s.commanded_us if s.commanded_us else ",,,"
    return f"{numbers.replace('nan', '') % labels},{pulses},{fix_fields(state)}\n".encode()


def fix_fields(state: EstimatedState) -> str:
    """What a receiver told anew (the last columns), for a fit of the vessel: between fixes the state is the estimator's own."""
    if state.fix_n_mps is None or state.fix_e_mps is None or state.position_age_s is None:
        return ",,"
    return f"{state.fix_n_mps:.4f},{state.fix_e_mps:.4f},{state.position_age_s:.3f}"


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Replace a small JSON file so that a power cut leaves the old or the new one, and a full disk too. Raises OSError."""
    with whole_file(path) as temporary, open(temporary, "wb", opener=_private) as file:
        file.write(json.dumps(content, indent=2, sort_keys=True, default=str).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())
    sync_folder(path.parent)


def _private(name: str, flags: int) -> int:
    return os.open(name, flags, FILE_MODE)
