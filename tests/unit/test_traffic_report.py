"""A meeting at sea, from what a run keeps of it to a section of the report with its picture."""

from __future__ import annotations

import json
import re
from typing import Any

from companion.io.recording.traffic_log import TrafficLog
from companion.report.encounters import meetings, sections
from companion.report.flight import Flight
from companion.report.page import make_page
from companion.report.sightings import sighting_of
from mavlink_bridge.language.messages import ActuatorOutput, Mode
from mavlink_bridge.language.snapshot import Snapshot
from sitl.traffic.target import VesselText
from sitl.traffic.transmitter import AisText
from tests.traffic_rig import Sea

NEUTRAL: Any = ActuatorOutput


def kept_of(sea: Sea, seconds: float) -> list[dict[str, Any]]:
    """What a recorder keeps of a voyage, as it stands in the file."""
    log, kept = TrafficLog(), []

    def look() -> None:
        snapshot = Snapshot(sea.now_us, 0, sea.state, Mode.AUTO, True, NEUTRAL, traffic=sea.picture)
        lines = [json.dumps({"t_s": sea.time_s, "event": "vessel", **fields}) for fields in log.changes(snapshot)]
        kept.extend(map(json.loads, lines))

    sea.run(seconds, look)
    return kept


def test_a_ship_that_crosses_is_kept_and_drawn() -> None:
    ship = VesselText(name="MV EXAMPLE", north_m=300.0, east_m=900.0, course_deg=270.0, speed_mps=4.5, length_m=60.0)
    far = VesselText(north_m=3000.0, east_m=-3000.0, speed_mps=3.0)
    seen = [sighting_of(each) for each in kept_of(Sea([ship, far], ais=AisText(loss_share=0.0)), 300)]
    (meeting,) = meetings(seen)
    assert meeting[0].danger == "risk"
    assert meeting[-1].danger == "none"
    assert {each.role for each in meeting[:-1]} == {"give way"}
    assert 10 < len(meeting) < 60
    page = sections(seen)
    assert page.count("<section class=encounter") == 1
    assert "MV EXAMPLE: give way" in page
    assert page.count("<polyline") == 3
    for points in re.findall(r"points='([^']*)'", page):
        for pair in points.split():
            assert all(-1.0 <= float(number) <= 361.0 for number in pair.split(","))


def test_the_picture_says_which_line_is_ours_where_both_began_and_went() -> None:
    ship = VesselText(name="MV <EXAMPLE>", north_m=300.0, east_m=900.0, course_deg=270.0, speed_mps=4.5, length_m=60.0)
    page = sections([sighting_of(each) for each in kept_of(Sea([ship], ais=AisText(loss_share=0.0)), 300)])
    legend = re.search(r"<p class=legend>(.*?)</p>", page)[1]
    colours = re.findall(r"border-color:(#\w+)'></i>([^<]+)<", legend)
    assert [words for _, words in colours] == ["we", "MV &lt;EXAMPLE&gt;", "between both at the nearest"]
    for colour, _ in colours[:2]:
        assert page.count("<circle") == 2
        assert re.search(rf"<circle [^>]*fill='{colour}'", page)
        assert re.search(rf"<path [^>]*fill='{colour}'", page)
    heads = dict(re.findall(r"fill='(#\w+)' transform='translate[^']*rotate\((-?\d+)\)", page))
    assert abs(int(heads[colours[0][0]]) + 90) < 5  # we go up
    assert abs(abs(int(heads[colours[1][0]])) - 180) < 5  # she to the left


def test_a_meeting_without_a_role_is_named_in_words() -> None:
    ship = VesselText(name="OVERTAKER", north_m=-300.0, east_m=17.0, speed_mps=2.6, length_m=100.0)
    page = sections([sighting_of(each) for each in kept_of(Sea([ship], ais=AisText(loss_share=0.0), own_mps=0.0), 250)])
    assert "<h2>OVERTAKER: beside us, or met while we lay still</h2>" in page
    assert "none" not in re.sub(r"fill='none'|<td>none", "", page)


def test_who_crosses_from_port_is_not_said_to_be_stood_on_for() -> None:
    """A vessel that fishes is kept clear of from whatever side she comes."""
    ship = VesselText(name="TRAWLER", north_m=200.0, east_m=-200.0, course_deg=90.0, speed_mps=1.5, status=7)
    page = sections([sighting_of(each) for each in kept_of(Sea([ship], ais=AisText(loss_share=0.0)), 200)])
    assert "<h2>TRAWLER: crossing from port</h2>" in page


def test_meetings_stand_in_the_reports_navigation() -> None:
    ship = VesselText(name="MV EXAMPLE", north_m=300.0, east_m=900.0, course_deg=270.0, speed_mps=4.5, length_m=60.0)
    seen = [sighting_of(each) for each in kept_of(Sea([ship], ais=AisText(loss_share=0.0)), 300)]
    page = make_page(Flight("a run", "events", vessels=seen))
    (target,) = re.findall(r"<nav>.*href='#(\w+)'>Meetings</a>.*</nav>", page)
    assert f"<section id={target}>" in page
    for anchor in re.findall(r"href='#(encounter-[^']*)'", page):
        assert f"id='{anchor}'" in page
    assert "Meetings" not in make_page(Flight("a run", "events"))


def test_without_others_the_report_says_nothing() -> None:
    assert sections([]) == ""
