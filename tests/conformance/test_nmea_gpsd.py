"""The NMEA reader against gpsd's own output over recorded receivers: position, time, speed, course, height, mode, heading, depth.

A gpsd *fix* is a run of reports (TPV) with the same time and position. It is reproduced when one of our fixes has its position
within one unit of the coarsest last digit in that log's sentences and its time within 1 ms. Two differences are counted as
reproduced and named: gpsd moves dates before its release by 1024 weeks, and some talkers put two times on one position.
The table goes to build/nmea_conformance.md.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import Distance, EulerAngles, FixType, GpsFix
from tests.replay.own_time import log_lines, replayed

BUILD = Path(__file__).resolve().parents[2] / "build"
GAPS_US = (
    2_000,
    70_000,
    pytest.param(0, marks=pytest.mark.soak),
    pytest.param(17_000, marks=pytest.mark.soak),
)
"""Between two lines of one moment: a fast wire, 9600 bit/s, one datagram, 38400 bit/s."""
EXACT_DEG = 2e-9
TIME_US = 1_000
ROLLOVER_US = 1024 * 7 * 86_400 * 10**6
SPEED_MPS = 0.06
TRACK_DEG = 0.11
HEIGHT_M = 0.06
MISSED_WHY = {
    "GPSmap-76S": "simulator mode: GGA quality 8 while RMC and GLL of the same second say void; gpsd itself withdraws it",
    "garmin-geko201": "simulator mode: GGA quality 8 while RMC and GLL of the same second say void; gpsd itself withdraws it",
}
NO_SPEED_IN = {
    "bundg_zeus_9": "the plotter sends GLL before RMC; gpsd reports between them, with speeds of its own making (0.3 m/s at 5 kn)",
}


NO_HEIGHT_IN = {"sounder": "GLL alone with mode D: no height, 2-D for gpsd, and differential here"}


@dataclass
class Row:
    log: str
    expected: int = 0
    exact: int = 0
    close: int = 0
    rollover: int = 0
    relabelled: int = 0
    missed: int = 0
    ours: int = 0
    unreported: int = 0
    denied: int = 0
    compared: dict[str, list[int]] = field(default_factory=lambda: {})

    def compare(self, what: str, good: bool) -> None:
        counts = self.compared.setdefault(what, [0, 0])
        counts[0] += good
        counts[1] += 1

    @property
    def matched(self) -> int:
        return self.exact + self.close + self.rollover + self.relabelled


def our_fixes(path: Path, gap_us: int) -> list[GpsFix]:
    """The fixes of the receiver that counts, from a log replayed at its own timing."""
    estimator = Estimator(EstimatorConfig())
    _, found = replayed(path, NmeaConfig(earliest_year=1980), gap_us)
    return [item for _, item in found if isinstance(item, GpsFix) and estimator.update(item)]


def reports_of(path: Path) -> list[dict]:
    text = path.read_text(errors="replace").splitlines()
    return [json.loads(line) for line in text if line.startswith('{"class":"TPV"')]


def time_us(report: dict) -> int | None:
    if "time" not in report:
        return None
    moment = datetime.fromisoformat(report["time"].replace("Z", "+00:00"))
    return round(moment.timestamp() * 1000) * 1000


def gpsd_fixes(reports: list[dict]) -> list[list[dict]]:
    """The runs of reports with the same time and position."""
    runs: list[list[dict]] = []
    for report in reports:
        if "lat" not in report:
            continue
        key = [report.get(name) for name in ("time", "lat", "lon")]
        if runs and [runs[-1][-1].get(name) for name in ("time", "lat", "lon")] == key:
            runs[-1].append(report)
        else:
            runs.append([report])
    return runs


def coarsest_deg(path: Path) -> float:
    """One unit of the coarsest last digit of any latitude in the log, in degrees."""
    decimals = re.findall(rb"\d{4}\.(\d+),[NS],", path.read_bytes())
    return max((10.0 ** -len(digits) / 60.0 for digits in decimals), default=0.0) + 2e-9


def off_deg(fix: GpsFix, report: dict) -> float:
    return max(abs(math.degrees(fix.lat_rad) - report["lat"]), abs(math.degrees(fix.lon_rad) - report["lon"]))


def judge_time(fix: GpsFix, report: dict) -> str:
    theirs = time_us(report)
    if theirs is None or fix.utc_us is None or abs(theirs - fix.utc_us) <= TIME_US:
        return "same"
    if abs(theirs - fix.utc_us - ROLLOVER_US) <= TIME_US:
        return "rollover"
    return "relabelled" if abs(theirs - fix.utc_us) <= 1_000_000 + TIME_US else "other"


def best_match(fixes: list[GpsFix], report: dict, tolerance_deg: float) -> tuple[str, GpsFix] | None:
    """Of a vessel at rest many fixes have one position: one whose time is known comes first."""
    order = ["exact", "close", "rollover", "relabelled"]
    found: list[tuple[int, bool, GpsFix]] = []
    for fix in fixes:
        off = off_deg(fix, report)
        when = judge_time(fix, report)
        if off > tolerance_deg or when == "other":
            continue
        kind = when if when != "same" else "exact" if off <= EXACT_DEG else "close"
        found.append((order.index(kind), fix.utc_us is None, fix))
    best = min(found, key=lambda each: each[:2], default=None)
    return None if best is None else (order[best[0]], best[2])


def compare_values(row: Row, fix: GpsFix, run: list[dict]) -> None:
    """A run grows as sentences arrive, so a value agrees when any of its reports has it."""
    last = run[-1]
    if row.log not in NO_SPEED_IN:
        compare_velocity(row, fix, run)
    if fix.height_msl_m is not None and "altMSL" in last:
        row.compare("height", abs(fix.height_msl_m - last["altMSL"]) <= HEIGHT_M)
    row.compare("mode", (last["mode"] == 3) == (fix.fix_type >= FixType.FIX_3D))


def compare_velocity(row: Row, fix: GpsFix, run: list[dict]) -> None:
    speeds = [report["speed"] for report in run if "speed" in report]
    if fix.sog_mps is not None and speeds:
        row.compare("speed", any(abs(fix.sog_mps - speed) <= SPEED_MPS for speed in speeds))
    tracks = [report["track"] for report in run if "track" in report]
    if fix.cog_rad is not None and tracks and (fix.sog_mps or 0.0) > 0.5:
        offs = [(math.degrees(fix.cog_rad) - track + 180.0) % 360.0 - 180.0 for track in tracks]
        row.compare("track", any(abs(off) <= TRACK_DEG for off in offs))


def unmatched(row: Row, fixes: list[GpsFix], reports: list[dict], tolerance_deg: float) -> None:
    """Fixes of ours without a report of gpsd's: *unreported* when gpsd is silent on that second, *denied* when it says no fix."""
    theirs = [report for report in reports if "lat" in report]
    for fix in fixes:
        if best_match_any(fix, theirs, tolerance_deg):
            continue
        at = [
            report for report in reports if time_us(report) is not None and abs(time_us(report) - fix.utc_us) <= TIME_US
        ]
        if any(report["mode"] == 1 for report in at):
            row.denied += 1
        else:
            row.unreported += 1


def best_match_any(fix: GpsFix, reports: list[dict], tolerance_deg: float) -> bool:
    return any(off_deg(fix, report) <= tolerance_deg and judge_time(fix, report) != "other" for report in reports)


def judge(path: Path, gap_us: int) -> Row:
    row = Row(path.name.removesuffix(".log"))
    fixes = [fix for fix in our_fixes(path, gap_us) if fix.has_position]
    reports = reports_of(path.with_name(path.name + ".chk"))
    tolerance_deg = coarsest_deg(path)
    row.ours = len(fixes)
    for run in gpsd_fixes(reports):
        row.expected += 1
        match = best_match(fixes, run[-1], tolerance_deg)
        if match is None:
            row.missed += 1
            continue
        setattr(row, match[0], getattr(row, match[0]) + 1)
        compare_values(row, match[1], run)
    unmatched(row, fixes, reports, tolerance_deg)
    return row


def write_table(rows: list[Row]) -> None:
    BUILD.mkdir(exist_ok=True)
    kinds = ("speed", "track", "height", "mode")
    head = ["log", "gpsd fixes", "matched", "exact", "within a digit", "1024 weeks", "other second", "missed", "ours"]
    head += ["gpsd silent", "gpsd denies", *kinds, "why"]
    lines = ["# Agreement with gpsd", "", "| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    total = Row("**all**")
    for row in rows:
        for name in ("expected", "exact", "close", "rollover", "relabelled", "missed", "ours", "unreported", "denied"):
            setattr(total, name, getattr(total, name) + getattr(row, name))
        for kind, (good, count) in row.compared.items():
            sums = total.compared.setdefault(kind, [0, 0])
            sums[0] += good
            sums[1] += count
    for row in [*rows, total]:
        cells: list[object] = [row.log, row.expected, row.matched, row.exact, row.close, row.rollover, row.relabelled]
        cells += [row.missed, row.ours, row.unreported, row.denied]
        cells += ["/".join(str(number) for number in row.compared.get(kind, (0, 0))) for kind in kinds]
        cells.append(MISSED_WHY.get(row.log, "") if row.missed else NO_SPEED_IN.get(row.log, ""))
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    (BUILD / "nmea_conformance.md").write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def logs(shared_data: Path) -> list[Path]:
    return sorted((shared_data / "nmea" / "gpsd").glob("*.log"))


@pytest.fixture(scope="module", params=GAPS_US)
def rows(logs: list[Path], request: pytest.FixtureRequest) -> list[Row]:
    rows = [judge(path, request.param) for path in logs]
    if request.param == GAPS_US[0]:
        write_table(rows)
    return rows


def test_at_least_99_percent_of_gpsds_fixes_are_reproduced_and_the_rest_explained(rows: list[Row]) -> None:
    expected = sum(row.expected for row in rows)
    assert expected > 1400
    assert sum(row.matched for row in rows) >= 0.99 * expected
    assert {row.log for row in rows if row.missed} <= set(MISSED_WHY)
    assert all(row.missed <= 1 for row in rows)


def test_the_bars_hold_for_each_log_by_itself(rows: list[Row]) -> None:
    """All but one fix, and all but one mode: gpsd's first report of a log may come from half an epoch."""
    for row in rows:
        good, count = row.compared.get("mode", [0, 0])
        assert row.missed <= max(1, 0.01 * row.expected), row
        assert count - good <= max(1, 0.02 * count) or row.log in NO_HEIGHT_IN, row


def test_no_fix_that_gpsd_denies(rows: list[Row]) -> None:
    assert {row.log: row.denied for row in rows if row.denied} == {}


def test_seconds_that_gpsd_leaves_unreported_are_few(rows: list[Row]) -> None:
    """gpsd reports at the end of its cycle: not before it has learned that, nor for the cut-off end of a log."""
    assert {row.log: row.unreported for row in rows if row.unreported > 3} == {}


@pytest.mark.parametrize(
    ("what", "share", "least"),
    [("speed", 0.99, 1000), ("track", 0.99, 90), ("height", 0.99, 1000), ("mode", 0.98, 1400)],
)
def test_values_agree(rows: list[Row], what: str, share: float, least: int) -> None:
    good = sum(row.compared.get(what, [0, 0])[0] for row in rows)
    count = sum(row.compared.get(what, [0, 0])[1] for row in rows)
    assert count >= least
    assert good >= share * count, f"{what}: {good} of {count}"


def test_hemisphere_headings_agree(shared_data: Path) -> None:
    path = shared_data / "nmea" / "gpsd" / "hemi.log"
    chk = path.with_name("hemi.log.chk").read_text().splitlines()
    theirs = [json.loads(line)["heading"] for line in chk if line.startswith('{"class":"ATT"')]
    reader = NmeaReader(NmeaConfig(earliest_year=1980))
    found = reader.receive(b"".join(log_lines(path)), 0)
    ours = [round(math.degrees(item.psi_rad) % 360.0, 3) for item in found if isinstance(item, EulerAngles)]
    assert ours == theirs
    assert len(ours) == 4


def test_depths_agree(shared_data: Path) -> None:
    """Each depth in a gpsd report is the newest DPT or DBT sentence before it (gpsd takes either, we take one kind)."""
    for kind in ("DPT", "DBT"):
        assert depth_agreement(shared_data / "nmea" / "gpsd" / "bundg_zeus_9.log.chk", kind) > 50


def depth_agreement(path: Path, kind: str) -> int:
    reader = NmeaReader(NmeaConfig(earliest_year=1980, sentences=kind))
    newest: float | None = None
    last_kind, agreed = "", 0
    for line in path.read_bytes().splitlines(keepends=True):
        if line[3:6] in (b"DPT", b"DBT"):
            last_kind = line[3:6].decode()
        for item in reader.receive(line, 0):
            if isinstance(item, Distance):
                newest = item.value_m
        if line.startswith(b'{"class":"TPV"') and last_kind == kind and newest is not None:
            depth = json.loads(line).get("depth")
            if depth is not None:
                assert depth == pytest.approx(newest, abs=0.0006)
                agreed += 1
    return agreed
