"""AIS recordings field by field against pyais and gpsd: five that boats made, and gpsd's own collections of every type.

Differences that remain are argued here: pyais rounds a turn to whole degrees a minute, strips blanks before a text and shows what
follows its end; gpsd puts the two parts of type 24 into one report, so its 24s are compared by what they say of a ship.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from companion.core.ais import PositionReport
from companion.core.ais.reports import StationClass
from tests.ais_judges import as_standard, gpsd_rows, in_whole_degrees_a_minute, ours, pyais_rows, received_in

OWN = Path(__file__).parents[1] / "data" / "ais"
RECORDINGS = {
    "gpsd/ais-nmea.log": 165,
    "gpsd/ait250.log": 72,
    "vessel/signalk_gofree-merrimac.log": 1459,
    "vessel/signalk_nais300-merrimac.log": 522,
    "vessel/opencpn_hakefjord_head.log": 2147,
}
"""Recordings and how many messages of our types they hold; types 6, 8, 20 and others are left to the judges."""
SAMPLES = ("sample.aivdm", "ais-18-27.log")


def read(name: str, shared_data: Path) -> bytes:
    if "/" in name:
        return (shared_data / "nmea" / name).read_bytes()
    return sample(name)


def sample(name: str) -> bytes:
    """A collection without its comments; some hold sentences that gpsd has given up on."""
    lines = (OWN / name).read_bytes().splitlines(keepends=True)
    return b"".join(line for line in lines if not line.startswith(b"#"))


@pytest.mark.parametrize("name", [*RECORDINGS, *SAMPLES])
def test_every_message_is_what_pyais_reads(name: str, shared_data: Path) -> None:
    data = read(name, shared_data)
    mine, theirs = ours(data), pyais_rows(data)
    if name in RECORDINGS:
        assert len(mine) == RECORDINGS[name]
    if name == "sample.aivdm":
        mine = [row for row in mine if row[1]["mmsi"] not in ONLY_WE_READ | WE_REFUSE]
        theirs = [row for row in theirs if row[1]["mmsi"] not in WE_REFUSE]
    assert [whole(kind) for kind, _ in theirs] == [kind for kind, _ in mine]
    for (kind, fields), (_, raw) in zip(mine, theirs, strict=True):
        wanted = {key: text.strip() if isinstance(text, str) else text for key, text in fields.items()}
        if kind == 1:
            wanted["turn"] = in_whole_degrees_a_minute(wanted["turn"])
        assert as_standard(kind, raw, fields) == wanted


WE_REFUSE = {244740981}
"""Its type 1 is sent twice: first with fill bits that leave 163 of 168 bits. What is cut may be anywhere; we wait for the whole."""
ONLY_WE_READ = {4000003}
"""pyais gives up on what follows the checksum."""


def whole(kind: int) -> int:
    return 1 if kind in (1, 2, 3) else kind


@pytest.mark.parametrize("name", ["sample.aivdm", "ais-18-27.log"])
def test_every_message_is_what_gpsd_has_written_of_it(name: str) -> None:
    """gpsd's own expectations, which come with its source."""
    chk = OWN / ("sample.aivdm.ju.chk" if name == "sample.aivdm" else "ais-18-27.log.chk")
    compare_with_gpsd(sample(name), chk.read_text("latin-1"))


@pytest.mark.soak
@pytest.mark.parametrize("name", [*RECORDINGS, *SAMPLES])
def test_every_message_is_what_gpsdecode_reads(name: str, shared_data: Path) -> None:
    if shutil.which("gpsdecode") is None:
        pytest.skip("gpsdecode (gpsd-clients) is not installed")
    data = read(name, shared_data)
    lines = b"".join(line + b"\n" for line in data.splitlines() if line[3:6] in (b"VDM", b"VDO"))
    found = subprocess.run(["gpsdecode", "-j", "-u"], input=lines, capture_output=True, check=True)
    compare_with_gpsd(data, found.stdout.decode("latin-1"))


def compare_with_gpsd(data: bytes, said: str) -> None:
    theirs = gpsd_rows(said.splitlines())
    mine = ours(data)
    singles = [row for row in mine if row[0] != 24 and row[1]["mmsi"] not in WE_REFUSE]
    judged = [row for row in theirs if row[0] != 24 and row[1]["mmsi"] not in WE_REFUSE]
    assert [whole(kind) for kind, _ in judged] == [kind for kind, _ in singles]
    for (kind, fields), (_, raw) in zip(singles, judged, strict=True):
        assert as_standard(kind, raw, fields) == fields
    assert_parts_agree([fields for kind, fields in mine if kind == 24], [raw for kind, raw in theirs if kind == 24])


def assert_parts_agree(mine: list[dict[str, Any]], theirs: list[dict[str, Any]]) -> None:
    """What gpsd says of a ship with a type 24 is something that we have read of her."""
    known: dict[int, list[dict[str, Any]]] = {}
    for fields in mine:
        known.setdefault(fields["mmsi"], []).append(fields)
    for raw in theirs:
        for name in ("shipname", "callsign", "ship_type", "to_bow", "to_stern", "to_port", "to_starboard"):
            if raw.get(name) not in (None, "", 0):
                assert raw[name] in [fields.get(name) for fields in known[raw["mmsi"]]]


def test_class_b_of_the_hakefjord_is_seen_and_the_own_ship_never_is(shared_data: Path) -> None:
    found = received_in(read("vessel/opencpn_hakefjord_head.log", shared_data))
    others = [each.report for each in found if isinstance(each.report, PositionReport) and not each.own]
    class_a = {report.mmsi for report in others if report.sent is StationClass.CLASS_A}
    class_b = [report.mmsi for report in others if report.sent is StationClass.CLASS_B]
    assert len(class_a) == 21
    assert len(set(class_b)) == 14
    assert len(class_b) == 144
    assert sum(each.own for each in found) == 1016
    assert {each.report.mmsi for each in found if each.own} == {265599690}
    assert 265599690 not in class_a | set(class_b)
