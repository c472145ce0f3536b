"""Recordings of ships and boats give sensible tracks: through the reader, and where they are timed, through the estimator."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import pytest

from companion.core.estimate.estimator import Estimator, EstimatorConfig
from companion.core.nmea.reader import NmeaConfig, NmeaReader
from mavlink_bridge.language.messages import Distance, EulerAngles, FixType, GpsFix
from mavlink_bridge.language.units import wrap_pi

OLD = NmeaConfig(earliest_year=2000)
STAMP = re.compile(rb"^(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.?\d*)")


class Log:
    """Everything one recording gives."""

    def __init__(self, path: Path, config: NmeaConfig = OLD, line_us: int = 5_000) -> None:
        self.reader = NmeaReader(config)
        self.found: list[tuple[int, object]] = []
        now_us = 0
        for line in lines_of(path):
            now_us = stamp_us(line) or now_us + line_us
            self.found += [(now_us, item) for item in (*self.reader.receive(line, now_us), *self.reader.poll(now_us))]
        self.found += [(now_us, item) for item in self.reader.poll(now_us + 1_000_000)]

    @property
    def fixes(self) -> list[GpsFix]:
        """Those of the receiver that counts."""
        estimator = Estimator(EstimatorConfig())
        read = [item for _, item in self.found if isinstance(item, GpsFix) and estimator.update(item)]
        return [item for item in read if item.has_position]

    @property
    def angles(self) -> list[EulerAngles]:
        return [item for _, item in self.found if isinstance(item, EulerAngles)]

    @property
    def depths(self) -> list[float]:
        """Those that count: a sounder says the same in several sentences."""
        estimator = Estimator(EstimatorConfig())
        read = [item for _, item in self.found if isinstance(item, Distance) and estimator.update(item)]
        return [item.value_m for item in read if item.value_m is not None]


def lines_of(path: Path) -> Iterator[bytes]:
    for line in path.read_bytes().splitlines(keepends=True):
        if not line.startswith(b"#"):
            yield line


def stamp_us(line: bytes) -> int | None:
    match = STAMP.match(line)
    if match is None:
        return None
    moment = datetime.fromisoformat(match.group(1).decode()[:26] + "+00:00")
    return round(moment.timestamp() * 1e6) - 1_400_000_000_000_000


def distance_m(a: GpsFix, b: GpsFix) -> float:
    north = (b.lat_rad - a.lat_rad) * 6.371e6
    return math.hypot(north, (b.lon_rad - a.lon_rad) * math.cos(a.lat_rad) * 6.378e6)


def fastest_mps(fixes: list[GpsFix]) -> float:
    """The highest speed between neighbours with different times."""
    speeds = [
        distance_m(a, b) / abs(b.utc_us - a.utc_us) * 1e6
        for a, b in itertools.pairwise(fixes)
        if a.utc_us is not None and b.utc_us is not None and abs(b.utc_us - a.utc_us) >= 500_000
    ]
    return max(speeds)


@pytest.fixture(scope="module")
def nmea(shared_data: Path) -> Path:
    return shared_data / "nmea"


def test_seapath_of_a_research_ship(nmea: Path) -> None:
    log = Log(nmea / "vessel" / "nbp1406_seap.log")
    assert len(log.fixes) == 715
    assert {fix.fix_type for fix in log.fixes} == {FixType.FIX_3D}
    steps = {b.utc_us - a.utc_us for a, b in itertools.pairwise(log.fixes)}
    assert steps == {990_000, 1_000_000, 1_010_000}
    between = [distance_m(a, b) for a, b in itertools.pairwise(log.fixes)]
    told = [fix.sog_mps for fix in log.fixes]
    assert told.count(None) == 1  # one VTG is not in the recording
    assert max(abs(d - v) for d, v in zip(between, told[1:], strict=True) if v is not None) < 0.6
    # HDT and PSXN,23 come from the same unit.
    rolls = [math.degrees(item.phi_rad) for item in log.angles if item.phi_rad is not None]
    assert len(rolls) == 714
    assert max(abs(roll) for roll in rolls) < 6.0
    for first, second in itertools.pairwise(log.angles):
        assert abs(wrap_pi(second.psi_rad - first.psi_rad)) < math.radians(1.0)


def test_seapath_through_the_estimator_in_its_own_time(nmea: Path) -> None:
    """1 Hz: predicted 0.9 s ahead, the state stays within half a metre of where the next fix then is, from a rolling ship."""
    log = Log(nmea / "vessel" / "nbp1406_seap.log")
    estimator = Estimator(EstimatorConfig(speed_max_mps=15.0))
    off: list[float] = []
    ready = 0
    for now_us, item in log.found:
        if isinstance(item, GpsFix) and estimator.origin is not None:
            state = estimator.predict(item.t_us)
            if state.position_valid:
                north, east = estimator.origin.to_local(item.lat_rad, item.lon_rad)
                off.append(math.hypot(state.x_m - north, state.y_m - east))
        estimator.update(item)
        ready += estimator.predict(now_us).position_valid
    assert len(off) > 700
    assert sorted(off)[len(off) // 2] < 0.35
    assert sorted(off)[int(0.95 * len(off))] < 1.0
    assert ready > 0.99 * len(log.found)
    assert [text for _, text in estimator.drain_texts()] == ["GNSS: 3-D fix, 10 satellites"]


def test_a_gyro_and_a_receiver_without_checksums(nmea: Path) -> None:
    gyro = Log(nmea / "vessel" / "nbp1406_gyr1.log")
    assert len(gyro.angles) == 5000
    gps = Log(nmea / "vessel" / "nbp1406_gp02.log", NmeaConfig(earliest_year=2000, checksum_required=False))
    assert len(gps.fixes) == 1667
    assert fastest_mps(gps.fixes) < 15.0
    speeds = [fix.sog_mps for fix in gps.fixes if fix.sog_mps is not None]
    assert len(speeds) == 1666  # one VTG is not in the recording
    assert 4.0 < min(speeds) < max(speeds) < 6.0
    assert Log(nmea / "vessel" / "nbp1406_gp02.log").fixes == []


def test_hemisphere_compass_from_cold_start(nmea: Path) -> None:
    log = Log(nmea / "gpsd" / "hemi.log")
    epochs = [item for _, item in log.found if isinstance(item, GpsFix)]
    assert len(epochs) == 215
    assert [fix.has_position for fix in epochs] == [False] * 209 + [True] * 6
    assert [round(math.degrees(item.psi_rad) % 360, 2) for item in log.angles] == [274.07, 274.04, 274.12, 274.11]


def test_humminbird_on_a_river_goes_back_in_time_once(nmea: Path) -> None:
    log = Log(nmea / "gpsd" / "humminbird-M37.log", line_us=330_000)
    assert len(log.fixes) == 33
    assert max(distance_m(a, b) for a, b in itertools.pairwise(log.fixes)) < 4.0
    assert sum(b.utc_us < a.utc_us for a, b in itertools.pairwise(log.fixes)) <= 1
    assert (min(log.depths), max(log.depths)) == (2.0, 2.6)


def test_sounder_in_harbour(nmea: Path) -> None:
    log = Log(nmea / "gpsd" / "sounder.log")
    assert len(log.fixes) == len(log.depths) == 122
    assert 2.2 < min(log.depths) <= max(log.depths) < 2.6
    assert max(distance_m(a, b) for a, b in itertools.pairwise(log.fixes)) < 5.0


def test_signal_k_recordings(nmea: Path) -> None:
    sailing = Log(nmea / "vessel" / "signalk_gps.log")
    assert len(sailing.fixes) == 1202
    assert fastest_mps(sailing.fixes) < 5.0
    berth = Log(nmea / "vessel" / "signalk_gofree-merrimac.log")
    assert len(berth.fixes) == 142
    assert fastest_mps(berth.fixes) < 2.0
    assert len(berth.depths) == 142
    compass = [item for item in berth.angles if item.psi_magnetic_rad is not None]
    assert len(compass) == 1375
    assert {round(math.degrees(item.variation_rad), 1) for item in compass} == {0.6}
    ais = Log(nmea / "vessel" / "signalk_nais300-merrimac.log")
    assert len(ais.fixes) == 10


def test_opencpn_recording_with_two_talkers_keeps_to_one(nmea: Path) -> None:
    log = Log(nmea / "vessel" / "opencpn_hakefjord_head.log")
    assert 1440 <= log.reader.counters["other_talker"] <= 1459
    assert len(log.fixes) > 1000
    assert max(distance_m(a, b) for a, b in itertools.pairwise(log.fixes)) < 25.0
    assert len(log.depths) == 1459
    assert 13.0 < min(log.depths) <= max(log.depths) < 17.0
    assert len(log.angles) == 1459


def test_uncrewed_vessel_whose_compass_gave_nothing(nmea: Path) -> None:
    log = Log(nmea / "vessel" / "clyde_udp_gps_compass_log.txt")
    assert len(log.fixes) == 129
    assert log.angles == []


def test_no_exception_from_any_recording_read_whole_and_in_pieces(nmea: Path) -> None:
    for path in sorted(nmea.rglob("*")):
        if not path.is_file() or path.suffix not in (".log", ".txt", ".nmea"):
            continue
        data = path.read_bytes()[:100_000]
        counters = []
        for size in (len(data), 977):
            reader = NmeaReader(OLD)
            for start in range(0, len(data), max(size, 1)):
                reader.receive(data[start : start + size], 0)
            reader.poll(10_000_000)
            counters.append(reader.counters)
        assert counters[0] == counters[1]
