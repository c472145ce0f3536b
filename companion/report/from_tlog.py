"""Reads a telemetry log of any MAVLink vehicle into a flight: what its messages tell, and nothing that they do not."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.language.messages import Severity
from mavlink_bridge.language.requests import PlanItem
from mavlink_bridge.language.units import e7_to_deg
from mavlink_bridge.mavlink.missions.wire import item_from_message
from mavlink_bridge.mavlink.persona.modes import FACES
from mavlink_bridge.mavlink.wire import tlog
from mavlink_bridge.mavlink.wire.codec import decode, dialect
from mavlink_bridge.mavlink.wire.framing import Frame

from .flight import Count, Event, Flight, FlightTrack, LinkStats, uncounted

Found = tlog.TlogRecord | tlog.Unread
LONGEST_GAP_S: Final = 86_400.0
"""A longer time between two lines or frames is damage, not a pause."""
SET_BACK_S: Final = 1.0
"""Stamps that go back further are those of a clock that was set; less is the disorder of several links."""
_STAMP_BYTES: Final = 8
_FAR_US: Final = round(LONGEST_GAP_S * 1e6)


def read_tlog(path: Path, *more: Path, numbered: bool = False, count: Count = uncounted) -> Flight:
    """Read a log, and the parts that it goes on in; the vehicle is the autopilot component heard most often.

    ``numbered``: the log is one of ours, whose stamps carry link numbers; others have noise there.
    """
    found = plausible(list(_scanned((path, *more), count)))
    records = [record for record in found if isinstance(record, tlog.TlogRecord)]
    vehicle = find_vehicle(records)
    flight = Flight(path.stem, path.name)
    if not records:
        flight.notes.append("the log holds no whole MAVLink frame")
        return flight
    _Reader(flight, vehicle, min(record.t_us for record in records[:50]), numbered).read(found, count)
    return flight


def _scanned(parts: tuple[Path, ...], count: Count) -> Iterator[Found]:
    """All records; to find them is half of the work, to understand them the other."""
    for part in parts:
        for record in tlog.scan(part.read_bytes()):
            count(_size(record) // 2)
            yield record


def _size(record: Found) -> int:
    return record.size if isinstance(record, tlog.Unread) else len(record.frame.raw) + _STAMP_BYTES


def plausible(records: list[Found]) -> list[Found]:
    """Leave out records with a damaged stamp (nothing guards it): far from the one before and from the one after."""
    kept: list[Found] = []
    for number, record in enumerate(records):
        before = kept[-1].t_us if kept else None
        after = records[number + 1].t_us if number + 1 < len(records) else before
        if any(near is not None and abs(record.t_us - near) < _FAR_US for near in (before, after)):
            kept.append(record)
    return kept or records[:1]


def find_vehicle(records: list[tlog.TlogRecord]) -> tuple[int, int] | None:
    """Return (system, component) of the vehicle: heartbeats of a type that is no ground station, most often heard."""
    heard: Counter[tuple[int, int]] = Counter()
    senders: Counter[tuple[int, int]] = Counter()
    for record in records:
        frame = record.frame
        senders[frame.system, frame.component] += 1
        if frame.message_id == 0 and not _is_other(frame.payload):
            heard[frame.system, frame.component] += 1
    best = heard or senders
    return best.most_common(1)[0][0] if best else None


def _is_other(heartbeat: bytes) -> bool:
    """A ground station, a camera, a gimbal: everything that is no autopilot."""
    kind, autopilot = heartbeat.ljust(6, b"\0")[4:6]
    return bool(kind == dialect.MAV_TYPE_GCS or autopilot == dialect.MAV_AUTOPILOT_INVALID)


class _Reader:
    """One reading under way."""

    def __init__(self, flight: Flight, vehicle: tuple[int, int] | None, start_us: int, numbered: bool) -> None:
        self._numbered = numbered
        self.flight = flight
        self.vehicle = vehicle
        self.start_us = start_us
        self.t_s = 0.0
        self._links: dict[int, LinkStats] = {}
        self._sequence: dict[tuple[int, int, int], int] = {}
        self._items: dict[int, dict[int, PlanItem]] = {0: {}, 1: {}, 2: {}}
        self._target: tuple[int, int] | None = None
        self._chunks: dict[int, str] = {}
        self._last_position_s = -1.0
        self._types: Counter[str] = Counter()
        self._handlers: dict[str, Callable[[Any], None]] = {
            name.removeprefix("_on_").upper(): getattr(self, name) for name in dir(self) if name.startswith("_on_")
        }

    def read(self, records: list[Found], count: Count) -> None:
        strange: Counter[int] = Counter()
        for record, after in zip(records, [*records[1:], records[-1]], strict=True):
            self._go_on(record.t_us, after.t_us)
            count(_size(record) // 2)
            if isinstance(record, tlog.Unread):
                self._count(record.link, record, record.size)
                strange[record.message_id] += 1
                continue
            self._count(record.link, record.frame, len(record.frame.raw))
            message = decode(record.frame)
            if message is not None:
                self._take(record, message)
        flight = self.flight
        if strange:
            ids = ", ".join(f"{number} ({count})" for number, count in strange.most_common(6))
            flight.notes.append(f"{sum(strange.values())} frames of messages that are not known here, by id: {ids}")
        flight.duration_s = self.t_s
        flight.links = [self._links[number] for number in sorted(self._links)]
        flight.plan, flight.fence, flight.rally = (self._plan(kind) for kind in range(3))
        try:
            start = datetime.fromtimestamp(self.start_us / 1e6, UTC)  # by the clock that was right in the end
            flight.about["start"] = start.strftime("%Y-%m-%d %H:%M:%S UTC")
        except (ValueError, OverflowError, OSError):
            flight.notes.append("the log's stamps are no microseconds since 1970: when it was is not known")
        flight.about["frames"] = str(len(records) - sum(strange.values()))
        for kind in flight.spans.values():
            kind[-1].end = max(kind[-1].end, kind[-1].start)

    def _go_on(self, t_us: int, after_us: int) -> None:
        """Time goes forward only, and no jump is a pause: a clock that was set in the middle of the run."""
        t_s = (t_us - self.start_us) * 1e-6
        newest_s = (max(t_us, after_us) - self.start_us) * 1e-6  # one stamp alone may be damaged
        if abs(t_s - self.t_s) > LONGEST_GAP_S or newest_s < self.t_s - SET_BACK_S:
            self.start_us += round((t_s - self.t_s) * 1e6)
        else:
            self.t_s = max(self.t_s, t_s)

    def _count(self, number: int, frame: Frame | tlog.Unread, size: int) -> None:
        """Traffic, and what is missing of it; a frame that is not understood was heard all the same."""
        number = number if self._numbered else 0
        link = self._links.get(number)
        if link is None:
            link = self._links[number] = LinkStats(f"link {number}")
        outgoing = self.vehicle is not None and frame.system == self.vehicle[0]
        link.add(self.t_s, size, outgoing)
        key = (number, frame.system, frame.component)
        before = self._sequence.get(key)
        self._sequence[key] = frame.sequence
        if before is not None:
            gap = (frame.sequence - before - 1) & 0xFF
            if 0 < gap < 128:
                if outgoing:
                    link.lost_out += gap
                else:
                    link.lost_in += gap

    def _take(self, record: tlog.TlogRecord, message: Any) -> None:
        name = message.get_type()
        self._types[name] += 1
        if name.startswith("MISSION_"):
            self._mission(name, message)
        elif self.vehicle is None or record.frame.system == self.vehicle[0]:
            handler = self._handlers.get(name)
            if handler is not None and (record.frame.component == (self.vehicle or (0, 1))[1] or name == "STATUSTEXT"):
                handler(message)

    # ---- plan ---------------------------------------------------------------------------------------------------

    def _mission(self, name: str, message: Any) -> None:
        kind = getattr(message, "mission_type", 0)
        if kind not in self._items:
            return
        if name == "MISSION_COUNT":
            self._items[kind] = {}
        elif name in ("MISSION_ITEM", "MISSION_ITEM_INT"):
            self._items[kind][message.seq] = item_from_message(message)
        elif name == "MISSION_ITEM_REACHED":
            self._note("reached", f"item {message.seq}")

    def _plan(self, kind: int) -> tuple[PlanItem, ...]:
        return tuple(self._items[kind][seq] for seq in sorted(self._items[kind]))

    # ---- messages of the vehicle --------------------------------------------------------------------------------

    def _note(self, kind: str, text: str, severity: str = "INFO") -> None:
        self.flight.events.append(Event(self.t_s, kind, text, severity))

    def _say(self, kind: str, value: str) -> None:
        spans = self.flight.spans.get(kind)
        if spans and spans[-1].value != value:
            self._note(kind, f"{spans[-1].value} → {value}")
        self.flight.say(kind, self.t_s, value)

    def _on_heartbeat(self, m: Any) -> None:
        self.flight.about["vehicle"] = f"{_name('MAV_TYPE', m.type)}, {_name('MAV_AUTOPILOT', m.autopilot)}"
        self._say("mode", mode_name(m))
        self._say("armed", "armed" if m.base_mode & 128 else "disarmed")

    def _on_statustext(self, m: Any) -> None:
        text = str(m.text)
        if getattr(m, "id", 0):
            text = self._chunks.pop(m.id, "") + text
            if len(str(m.text)) == 50:
                self._chunks[m.id] = text
                return
        severity = Severity(m.severity).name if m.severity in frozenset(Severity) else "INFO"
        self._note("text", text, severity)

    def _position(self, lat: int, lon: int) -> None:
        if (lat or lon) and abs(lat) <= 900_000_000 and self.t_s > self._last_position_s:
            self._last_position_s = self.t_s
            self.flight.tracks.setdefault("estimate", FlightTrack()).add(self.t_s, e7_to_deg(lat), e7_to_deg(lon))

    def _on_global_position_int(self, m: Any) -> None:
        self._position(m.lat, m.lon)

    def _on_gps_raw_int(self, m: Any) -> None:
        if m.fix_type >= 2 and "GLOBAL_POSITION_INT" not in self._types:
            self._position(m.lat, m.lon)
        self.flight.of("satellites").add(self.t_s, m.satellites_visible if m.satellites_visible != 255 else None)

    def _on_vfr_hud(self, m: Any) -> None:
        self.flight.of("heading_deg").add(self.t_s, m.heading)
        self.flight.of("speed_mps").add(self.t_s, m.groundspeed)
        self.flight.of("throttle").add(self.t_s, m.throttle / 100.0)

    def _on_attitude(self, m: Any) -> None:
        self.flight.of("roll_deg").add(self.t_s, math.degrees(m.roll))
        self.flight.of("pitch_deg").add(self.t_s, math.degrees(m.pitch))
        self.flight.of("yaw_rate_dps").add(self.t_s, math.degrees(m.yawspeed))

    def _on_nav_controller_output(self, m: Any) -> None:
        self.flight.of("heading_ref_deg").add(self.t_s, m.nav_bearing)
        self.flight.of("cross_track_m").add(self.t_s, m.xtrack_error)
        self.flight.of("distance_m").add(self.t_s, m.wp_dist)

    def _on_servo_output_raw(self, m: Any) -> None:
        for number in range(1, 5):
            pulse = getattr(m, f"servo{number}_raw")
            self.flight.of(f"servo{number}_us").add(self.t_s, pulse if pulse else None)

    def _on_water_depth(self, m: Any) -> None:
        self.flight.of("depth_m").add(self.t_s, m.distance if math.isfinite(m.distance) else None)

    def _on_distance_sensor(self, m: Any) -> None:
        if "WATER_DEPTH" not in self._types and m.orientation == 25:
            self.flight.of("depth_m").add(self.t_s, m.current_distance / 100.0)

    def _on_rangefinder(self, m: Any) -> None:
        if "WATER_DEPTH" not in self._types and "DISTANCE_SENSOR" not in self._types:
            self.flight.of("depth_m").add(self.t_s, m.distance)

    def _on_sys_status(self, m: Any) -> None:
        if 0 < m.voltage_battery < 65535:
            self.flight.of("voltage_v").add(self.t_s, m.voltage_battery / 1000.0)
        self.flight.of("load").add(self.t_s, m.load / 1000.0)

    def _on_radio_status(self, m: Any) -> None:
        self.flight.of("rssi").add(self.t_s, m.rssi)

    def _on_radio(self, m: Any) -> None:
        self._on_radio_status(m)


def mode_name(m: Any) -> str:
    """A mode in words where its number is known, else the number."""
    rover = m.autopilot == dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
    if not rover or m.type in (dialect.MAV_TYPE_GROUND_ROVER, dialect.MAV_TYPE_SURFACE_BOAT):
        for face in FACES:
            if m.custom_mode and m.custom_mode == (face.rover if rover else face.px4):
                return face.mode.value
    return f"mode {m.custom_mode}"


def _name(enum: str, value: int) -> str:
    found = dialect.enums.get(enum, {}).get(value)
    return str(found.name).removeprefix(f"{enum}_").replace("_", " ").lower() if found else f"{value}"
