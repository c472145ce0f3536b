"""AIS sentences as three programs read them, in one form: a type, and its fields as the whole numbers of the standard; None for a sentinel.

Ours is turned back from SI. pyais and gpsd wrote the other two; where they show what the standard calls "not available" as a
number, it becomes None here, by the standard's tables.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections.abc import Iterable
from typing import Any

from companion.core.ais import AidToNavigation, AisReceiver, BaseStation, PositionReport, SafetyText, StaticReport
from companion.core.ais.receiver import is_ais
from companion.core.ais.reports import StationClass
from companion.core.nmea.line import LineReader
from mavlink_bridge.language.units import KNOT_MPS

Row = tuple[int, dict[str, Any]]
TYPES = (1, 2, 3, 4, 5, 9, 14, 18, 19, 21, 24, 27)


def reports(data: bytes, step_us: int = 1000) -> list[Any]:
    """Everything that our receiver takes out of a recording, in its order."""
    return [received.report for received in received_in(data, step_us)]


def received_in(data: bytes, step_us: int = 1000) -> list[Any]:
    reader, receiver = LineReader(), AisReceiver()
    found = []
    for number, line in enumerate(data.splitlines(keepends=True)):
        for body in reader.receive(line):
            fields = body.split(",")
            if is_ais(fields[0]):
                found += receiver.sentence(fields, number * step_us)
    return found


# ---- ours


def ours(data: bytes) -> list[Row]:
    rows: list[Row] = []
    for report in reports(data):
        if isinstance(report, StaticReport) and report.kind == 19:
            rows[-1] = (19, rows[-1][1] | our_fields(report)[1])  # one message, two reports
        else:
            rows.append(our_fields(report))
    return rows


def our_fields(report: Any) -> Row:
    match report:
        case PositionReport():
            return position_row(report)
        case BaseStation():
            place = fine(report.lat_rad, report.lon_rad)
            return 4, {"mmsi": report.mmsi, **place, "accuracy": report.accurate, "utc": report.utc}
        case AidToNavigation():
            return 21, {
                "mmsi": report.mmsi,
                **fine(report.lat_rad, report.lon_rad),
                "accuracy": report.accurate,
                "aid_type": report.aid_type,
                "name": report.name,
                "second": report.second,
                "off_position": report.off_position,
                "virtual_aid": report.virtual,
                **sides(report.dimensions),
            }
        case SafetyText():
            return 14, {"mmsi": report.mmsi, "text": report.text}
        case StaticReport():
            return static_row(report)
    raise AssertionError(report)


def position_row(report: PositionReport) -> Row:
    coarse = report.sent is StationClass.LONG_RANGE
    kind = {
        StationClass.CLASS_A: 1,
        StationClass.CLASS_B: 18,
        StationClass.SAR_AIRCRAFT: 9,
        StationClass.LONG_RANGE: 27,
    }
    step = KNOT_MPS if coarse or report.sent is StationClass.SAR_AIRCRAFT else KNOT_MPS / 10
    turn = math.radians(1.0 if coarse else 0.1)
    row: dict[str, Any] = {
        "mmsi": report.mmsi,
        **fine(report.lat_rad, report.lon_rad, 10 if coarse else 10_000),
        "speed": None if report.sog_mps is None else round(report.sog_mps / step),
        "course": None if report.cog_rad is None else round(report.cog_rad / turn),
        "accuracy": report.accurate,
        "raim": report.raim,
    }
    if not coarse:
        row["second"] = report.second
    if report.sent in (StationClass.CLASS_A, StationClass.CLASS_B):
        row["heading"] = None if report.heading_rad is None else round(math.degrees(report.heading_rad))
    if report.sent is StationClass.CLASS_A:
        row["turn"] = turn_code(report)
    if report.sent in (StationClass.CLASS_A, StationClass.LONG_RANGE):
        row["status"] = report.status
    if report.sent is StationClass.SAR_AIRCRAFT:
        row["alt"] = report.altitude_m
    if report.carrier_sense is not None:
        row["cs"] = report.carrier_sense
    if coarse:
        row["gnss"] = report.late
    return kind[report.sent], row


def turn_code(report: PositionReport) -> int | None:
    if report.turn_sign:
        return 127 * report.turn_sign
    if report.turn_radps is None:
        return None
    deg_min = math.degrees(report.turn_radps) * 60
    return round(math.copysign(4.733 * math.sqrt(abs(deg_min)), deg_min))


def static_row(report: StaticReport) -> Row:
    row: dict[str, Any] = {"mmsi": report.mmsi}
    if report.name is not None:
        row["shipname"] = report.name
    if report.callsign is not None:
        row["callsign"] = report.callsign
    if report.ship_type is not None:
        row["ship_type"] = report.ship_type
    if report.kind == 5:
        draught = None if report.draught_m is None else round(report.draught_m * 10)
        row |= {"imo": report.imo, "draught": draught, "destination": report.destination, "epfd": report.fix_type}
    if report.kind == 19:
        row["epfd"] = report.fix_type
    if report.mothership is not None:
        row["mothership_mmsi"] = report.mothership
    elif report.kind != 24 or report.callsign is not None:
        row |= sides(report.dimensions)
    return report.kind, row


def fine(lat_rad: float | None, lon_rad: float | None, steps: int = 10_000) -> dict[str, int | None]:
    if lat_rad is None or lon_rad is None:
        return {"lat": None, "lon": None}
    return {"lat": round(math.degrees(lat_rad) * 60 * steps), "lon": round(math.degrees(lon_rad) * 60 * steps)}


def sides(dimensions: Any) -> dict[str, int]:
    if dimensions is None:
        return {"to_bow": 0, "to_stern": 0, "to_port": 0, "to_starboard": 0}
    return {
        "to_bow": dimensions.bow_m,
        "to_stern": dimensions.stern_m,
        "to_port": dimensions.port_m,
        "to_starboard": dimensions.starboard_m,
    }


# ---- the judges


def as_standard(kind: int, theirs: dict[str, Any], wanted: dict[str, Any]) -> dict[str, Any]:
    """A judge's raw numbers, only the fields that ours has, sentinels as None."""
    steps = 10 if kind == 27 else 10_000
    row = {name: theirs[name] for name in wanted if name in theirs}
    if "lat" in row and (abs(row["lat"]) > 90 * 60 * steps or abs(row["lon"]) > 180 * 60 * steps):
        row["lat"] = row["lon"] = None
    if "speed" in row and row["speed"] == (63 if kind == 27 else 1023):
        row["speed"] = None
    if "course" in row and row["course"] >= (360 if kind == 27 else 3600):
        row["course"] = None
    if "heading" in row and row["heading"] >= 360:
        row["heading"] = None
    if "second" in row and row["second"] >= 60:
        row["second"] = None
    if row.get("turn") == -128:
        row["turn"] = None
    if row.get("alt") == 4095:
        row["alt"] = None
    if "off_position" in row and (row["aid_type"] < 20 or row["second"] is None):
        row["off_position"] = None
    for name in ("imo", "draught"):
        if row.get(name) == 0:
            row[name] = None
    return row


def pyais_rows(data: bytes) -> list[tuple[int, dict[str, Any]]]:
    """What pyais delivers of the types that we read, raw; what it delivers with a bad checksum is left out."""
    from pyais.exceptions import AISBaseException as PyaisError
    from pyais.queue import NMEAQueue

    queue, rows = NMEAQueue(), []
    for line in data.splitlines():
        start = line.find(b"!")
        if start < 0 or line[3:6] not in (b"VDM", b"VDO"):
            continue
        queue.put_line(line[start:])
        message = queue.get_or_none()
        if message is None or not message.is_valid:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                fields = message.decode().asdict(enum_as_int=True)
            except PyaisError:
                continue
        if fields["msg_type"] in TYPES:
            rows.append((fields["msg_type"], pyais_raw(fields)))
    return rows


def pyais_raw(fields: dict[str, Any]) -> dict[str, Any]:
    kind = fields["msg_type"]
    steps = 10 if kind == 27 else 10_000
    row = dict(fields)
    if "lat" in row:
        row["lat"], row["lon"] = round(row["lat"] * 60 * steps), round(row["lon"] * 60 * steps)
    if "speed" in row and kind not in (9, 27):
        row["speed"] = round(row["speed"] * 10)
    if "course" in row and kind != 27:
        row["course"] = round(row["course"] * 10)
    if "draught" in row:
        row["draught"] = round(row["draught"] * 10)
    if "turn" in row:
        row["turn"] = float(row["turn"])
    if kind == 4:
        parts = tuple(int(row[name]) for name in ("year", "month", "day", "hour", "minute", "second"))
        row["utc"] = utc_or_none(parts)
    if kind == 21:
        row["name"] = row["full_name"]
    # pyais shows what stands behind the end of a text
    return {key: text.partition("@")[0].strip() if isinstance(text, str) else text for key, text in row.items()}


def in_whole_degrees_a_minute(code: int | None) -> float | None:
    """A turn as pyais shows it: rounded; the codes of turns without a value as they are."""
    if code is None or abs(code) == 127:
        return code
    return float(round(math.copysign((code / 4.733) ** 2, code)))


def utc_or_none(parts: tuple[int, ...]) -> tuple[int, ...] | None:
    year, month, day, hour, minute, second = parts
    return parts if year and 1 <= month <= 12 and day and hour < 24 and minute < 60 and second < 60 else None


def gpsd_rows(lines: Iterable[str]) -> list[tuple[int, dict[str, Any]]]:
    """What gpsd's unscaled JSON says of the types that we read."""
    rows = []
    for line in lines:
        if not line.startswith('{"class":"AIS"'):
            continue
        row = json.loads(line)
        kind = row["type"]
        if kind not in TYPES:
            continue
        row["ship_type"] = row.get("shiptype")
        if kind == 4:
            row["utc"] = utc_or_none(tuple(map(int, re.findall(r"\d+", row["timestamp"]))))
        rows.append((kind, row))
    return rows
