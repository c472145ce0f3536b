"""Reads a run directory into a flight: control.csv, truth.csv, events.jsonl, run.json, and the log of its frames."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.requests import LoadPlan, PlanItem, PlanKind

from ..core.vehicle.config import SystemConfig
from ..io.keeping.content import from_json
from ..io.log_file import parts_of
from ..io.recording import InputReader, InputsError, digests, request_json
from ..io.recording.about import AboutError, read_about
from ..io.recording.recorder import CONTROL_COLUMNS, CONTROL_WIDTHS
from .airtime import Airtime
from .flight import Count, Event, Flight, FlightTrack, uncounted
from .from_tlog import LONGEST_GAP_S, read_tlog
from .sightings import sighting_of
from .verdicts import moment

_EVENT_MAX: Final = 1 << 16
"""Characters of one event, at most: a power cut may leave a file of gigabytes without a line."""
_COLUMNS: Final = tuple(CONTROL_COLUMNS.split(","))
_AT: Final = {name: index for index, name in enumerate(_COLUMNS)}
_SERIES: Final = (
    "heading_deg",
    "heading_ref_deg",
    "heading_error_deg",
    "speed_mps",
    "speed_ref_mps",
    "speed_error_mps",
    "yaw_rate_dps",
    "sog_mps",
    "cross_track_m",
    "distance_m",
    "orbit_radius_m",
    "on_path",
    "altitude_m",
    "altitude_raw_m",
    "altitude_limit_m",
    "thruster_port",
    "thruster_starboard",
    "rudder_port_deg",
    "rudder_starboard_deg",
)
_STATES: Final = ("mode", "guard", "action", "plan_state", "cause")
_HOLE_S: Final = 0.5
"""So much lost at once is a disk that took nothing, a second's rows at least; less is a damaged line."""
_PLAN_STATES: Final = {"1": "no plan", "2": "not started", "3": "active", "4": "paused", "5": "complete"}


def read_run(run_dir: Path, count: Count = uncounted) -> Flight:
    """Read what is there; a missing or damaged file is a note, never an error."""
    flight = Flight(run_dir.resolve().name, "run directory")
    flight.not_whole = _not_whole(run_dir)
    _about(flight, run_dir)
    _frames(flight, run_dir, count)
    _control(flight, run_dir, count)
    _truth(flight, run_dir, count)
    _events(flight, run_dir)
    _plans(flight, run_dir, count)
    return flight


def _not_whole(run_dir: Path) -> str:
    found = (("damaged", ", ".join(digests.damaged(run_dir))), ("not all kept", digests.never_kept(run_dir)))
    return "; ".join(f"{what}: {names}" for what, names in found if names)


def bytes_of(run_dir: Path) -> int:
    """How much ``read_run`` goes through."""
    names = ("mavlink.tlog", "control.csv", "truth.csv", "inputs.bin")
    return sum(part.stat().st_size for name in names for part in parts_of(run_dir / name))


def _about(flight: Flight, run_dir: Path) -> None:
    try:
        about = read_about(run_dir)
    except FileNotFoundError:
        flight.notes.append("no run.json")
        about = {}
    except AboutError as error:
        flight.notes.append(f"run.json: {error}")
        about = {}
    settings = about.pop("settings", None) or _recorded_settings(run_dir)
    flight.settings = settings if isinstance(settings, dict) else {}
    name = flight.settings.get("system", {}).get("name") if flight.settings else None
    flight.about["vehicle"] = f"{name or 'vessel'}, hull {flight.settings.get('vessel', 'unknown')}"
    flight.about.update({key: str(value) for key, value in about.items() if not isinstance(value, dict | list)})


def _recorded_settings(run_dir: Path) -> dict[str, Any]:
    """The settings in the header of the recorded inputs."""
    try:
        reader = InputReader(run_dir / "inputs.bin")
    except (OSError, InputsError):
        return {}
    reader.close()
    settings = reader.meta.get("settings", {})
    return settings if isinstance(settings, dict) else {}


def _frames(flight: Flight, run_dir: Path, count: Count) -> None:
    """Links and plans from the telemetry log; everything else is better known from control.csv."""
    parts = parts_of(run_dir / "mavlink.tlog")
    if not parts:
        flight.notes.append("no telemetry log")
        return
    log = read_tlog(*parts, numbered=True, count=count)
    flight.links, flight.plan, flight.fence, flight.rally = log.links, log.plan, log.fence, log.rally
    names = [str(item.get("name")) for item in flight.settings.get("endpoints", [])]
    if flight.settings.get("radio", {}).get("url"):
        names.append("radio")
    for link in flight.links:
        number = int(link.name.removeprefix("link "))
        if number < len(names):
            link.name = names[number]
    if "start" in log.about:
        flight.about["start"] = log.about["start"]
    for name in ("voltage_v", "load", "depth_m", "satellites", "roll_deg", "pitch_deg"):
        if name in log.series:
            flight.series[name] = log.series[name]


def _rows(paths: list[Path], widths: Sequence[int], count: Count) -> Iterator[list[str]]:
    """Rows of a table and its parts; headers, a line that was cut and a row of another table are left out."""
    for path in paths:
        with path.open(encoding="utf-8", errors="replace") as file:
            next(file, None)
            for line in file:
                count(len(line))
                row = line.rstrip("\n").split(",")
                if len(row) in widths and line.endswith("\n"):
                    yield row


def _control(flight: Flight, run_dir: Path, count: Count) -> None:
    parts = parts_of(run_dir / "control.csv")
    if not parts:
        flight.notes.append("no control.csv: nothing of the control loops is shown")
        return
    wanted = [(flight.of(name), _AT[name]) for name in _SERIES]
    track = FlightTrack()
    last_s: float | None = None
    ticks = _Ticks(flight.settings)
    last_states: list[str] = []
    known: dict[bool, list[bool]] = {False: [], True: []}
    for row in _rows(parts, CONTROL_WIDTHS, count):
        try:
            t_s = _after(last_s, row[0])
            values = [float(row[at]) if row[at] else math.nan for _, at in wanted]
            number = int(row[_AT["tick"]])
            is_known = bool(row[_AT["lat_deg"]] and row[_AT["lon_deg"]])
            known[row[_AT["armed"]] == "1"].append(is_known)
            if is_known:
                track.add(t_s, float(row[_AT["lat_deg"]]), float(row[_AT["lon_deg"]]))
        except ValueError:
            continue  # a damaged line
        for (series, _), value in zip(wanted, values, strict=True):
            series.t.append(t_s)
            series.v.append(value)
        states = [row[_AT["armed"]], row[_AT["item"]], *(row[_AT[name]] for name in _STATES)]
        if states != last_states:
            _say_states(flight, t_s, row)
            last_states = states
        ticks.take(t_s, number)
        last_s = t_s
    if last_s is not None:
        flight.duration_s = last_s
        flight.gap_s = ticks.gap_s
        flight.not_whole = "; ".join(filter(None, (flight.not_whole, *ticks.holes)))
        judged = known[True] or known[False]
        flight.position_share = sum(judged) / len(judged) if judged else None
        for spans in flight.spans.values():
            spans[-1].end = last_s
    if track:
        flight.tracks["estimate"] = track
    flight.series = {name: series for name, series in flight.series.items() if series}


class _Ticks:
    """How the ticks followed one another, by their numbers: a row that could not be written is no tick that was not."""

    def __init__(self, settings: dict[str, Any]) -> None:
        rate_hz = settings.get("system", {}).get("tick_hz")
        self._period_s = 1.0 / (rate_hz if isinstance(rate_hz, int) and rate_hz > 0 else SystemConfig().tick_hz)
        self._last: tuple[float, int] | None = None
        self.gap_s = 0.0
        """Longest time between two ticks; at most so long where rows are lost, all that was late being one tick's."""
        self.holes: list[str] = []
        """When nothing was written, in words."""

    def take(self, t_s: float, number: int) -> None:
        """Take the next row that is there."""
        if self._last is not None:
            last_s, last_number = self._last
            lost_s = max(0, number - last_number - 1) * self._period_s
            self.gap_s = max(self.gap_s, t_s - last_s - lost_s)
            if lost_s >= _HOLE_S:
                self.holes.append(f"nothing in control.csv from {moment(last_s)} to {moment(t_s)}, the loop ran on")
        self._last = t_s, number


def _after(last_s: float | None, text: str) -> float:
    """A row's time. Raises ValueError for one that cannot follow ``last_s``: damage."""
    t_s = float(text)
    if not 0.0 <= t_s - (last_s or 0.0) < LONGEST_GAP_S:
        raise ValueError(text)
    return t_s


def _say_states(flight: Flight, t_s: float, row: list[str]) -> None:
    for name in _STATES:
        value = row[_AT[name]]
        flight.say(name, t_s, _PLAN_STATES.get(value, value) if name == "plan_state" else value)
    flight.say("armed", t_s, "armed" if row[_AT["armed"]] == "1" else "disarmed")
    flight.say("item", t_s, row[_AT["item"]])


def _truth(flight: Flight, run_dir: Path, count: Count) -> None:
    parts = parts_of(run_dir / "truth.csv")
    if not parts:
        return
    from ..io.recording.truth import TRUTH_COLUMNS

    columns = TRUTH_COLUMNS.split(",")
    at = {name: index for index, name in enumerate(columns)}
    track = FlightTrack()
    t_s: float | None = None
    names = ("depth_m", "altitude_m", "heading_deg", "sog_mps")
    for row in _rows(parts, (len(columns),), count):
        try:
            t_s = _after(t_s, row[0])
            values = [float(row[at[name]]) for name in names]
            track.add(t_s, float(row[at["lat_deg"]]), float(row[at["lon_deg"]]))
            for name, value in zip(names, values, strict=True):
                flight.of(f"true_{name}").add(t_s, value)
        except ValueError:
            continue
    if track:
        flight.tracks["truth"] = track


def _events(flight: Flight, run_dir: Path) -> None:
    parts = parts_of(run_dir / "events.jsonl")
    if not parts:
        flight.notes.append("no events.jsonl")
    for path in parts:
        with path.open(encoding="utf-8", errors="replace") as file:
            while line := file.readline(_EVENT_MAX):
                try:
                    data = json.loads(line)
                    if data["event"] == "vessel":
                        flight.vessels.append(sighting_of(data))
                    else:
                        flight.events.append(_event(data))
                except (ValueError, KeyError, TypeError, IndexError, RecursionError):
                    continue  # a line that was cut


def _order(data: dict[str, Any]) -> str:
    """Who ordered what, and what came of it."""
    who = "aboard"
    if "system" in data:
        host = f" from {data['host']}" if data.get("host") else ""
        who = f"station {data['system']}/{data['component']} over {data['link']}{host} ({data['proof']})"
    reason = f": {data['reason']}" if data.get("reason") else ""
    return f"{who}: {data['order']} - {str(data['result']).lower().replace('_', ' ')}{reason}"


def _event(data: dict[str, Any]) -> Event:
    kind, t_s = str(data["event"]), float(data["t_s"])
    if not math.isfinite(t_s):
        raise ValueError(t_s)
    if kind == "text":
        return Event(t_s, kind, str(data["text"]), str(data["severity"]))
    if kind == "order":
        return Event(t_s, kind, _order(data))
    if "value" in data:
        before = data.get("before")
        shown = f"{_shown(before)} → {_shown(data['value'])}" if before is not None else _shown(data["value"])
        return Event(t_s, kind, shown)
    return Event(t_s, kind, ", ".join(f"{key} {value}" for key, value in data.items() if key not in ("t_s", "event")))


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return {True: "yes", False: "no"}.get(value, str(value)) if isinstance(value, bool) else str(value)


def _walk(reader: InputReader, airtime: Airtime, found: dict[PlanKind, tuple[PlanItem, ...]], count: Count) -> None:
    """Go through the recorded steps once: airtime, and the last plan of each kind handed over inside the process."""
    at = reader.at
    for step in reader.steps():
        count(reader.at - at)
        at = reader.at
        airtime.take(step)
        for text in step.submitted:
            body, _ = request_json.loads(text)
            if isinstance(body, LoadPlan):
                found[body.kind] = body.items


def _plans(flight: Flight, run_dir: Path, count: Count) -> None:
    """Plans that came over no link: from the store at start, or handed over inside the process."""
    try:
        reader = InputReader(run_dir / "inputs.bin")
    except (OSError, InputsError) as error:
        flight.notes.append(f"inputs.bin: {getattr(error, 'strerror', None) or error}")
        return
    plans: dict[PlanKind, tuple[PlanItem, ...]] = {}
    try:
        plans.update(from_json(reader.store).plans)
        _walk(reader, Airtime(flight, reader.meta), plans, count)
        if reader.cut:
            flight.notes.append("the recorded inputs end in an unfinished record (the run was cut short)")
    except (InputsError, ValueError) as error:
        flight.notes.append(f"inputs.bin: {error}")
    finally:
        reader.close()
    flight.plan = flight.plan or plans.get(PlanKind.MISSION, ())
    flight.fence = flight.fence or plans.get(PlanKind.FENCE, ())
    flight.rally = flight.rally or plans.get(PlanKind.RALLY, ())
