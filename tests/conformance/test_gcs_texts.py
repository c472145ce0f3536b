"""What an operator reads: greetings that are seen, numbers and names as the station has them, refusals with a reason, severities."""

from __future__ import annotations

import pytest

from mavlink_bridge.language.messages import Action, Severity
from mavlink_bridge.language.requests import Arm, Reply, Result
from mavlink_bridge.language.snapshot import Outlook
from mavlink_bridge.mavlink.wire.codec import dialect
from tests.fake_vessel import Bench, Station
from tests.qgc_rig import Screen
from tests.world_station import GCS_HEARTBEAT


def said(bench: Bench) -> list[str]:
    """Texts, put together from their chunks."""
    texts, part = [], ""
    for message in bench.gcs.all("STATUSTEXT"):
        part += message.text
        if not message.id or len(message.text.encode()) < 50:
            texts.append(part)
            part = ""
    return texts


def test_who_asks_is_greeted_again_when_its_window_shows_texts(bench):
    bench.vessel.changes["standing"] = ((Severity.WARNING, "depth guard OFF"),)
    bench.vessel.changes["outlook"] = (
        Outlook("gcs_lost", "ground station lost", "holding", Action.RETURN, 48.2, until="until it is back"),
    )
    bench.send(GCS_HEARTBEAT)
    bench.run(1.0)
    bench.gcs.clear()
    bench.run(5.0)
    assert bench.texts() == "", "a listener has been greeted at its first heartbeat"
    bench.long(512, 148)
    bench.run(2.9)
    assert bench.texts() == ""
    bench.run(0.2)
    first, *rest = said(bench)
    assert bench.vessel.identity.name in first
    assert rest[0] == "depth guard OFF"
    assert rest[1] == "Ground station lost: holding, RETURN in 48 s; until it is back"
    bench.gcs.clear()
    bench.send(GCS_HEARTBEAT)
    bench.long(512, 300)
    bench.run(3.2)
    assert bench.texts() == "", "once"


@pytest.mark.parametrize(("gone_s", "first"), [(6.0, (512, 300)), (12.5, (512, 148))])
def test_a_station_that_was_started_again_is_greeted_again(bench, gone_s, first):
    bench.long(512, 148)
    bench.run(3.2)
    for _ in range(round(gone_s)):
        if gone_s > 10.0:
            bench.send(GCS_HEARTBEAT)
        bench.run(1.0)
    bench.gcs.clear()
    bench.long(*first)
    bench.run(3.2)
    assert bench.vessel.identity.name in bench.texts()


def test_other_peoples_talk_is_no_request(bench):
    bench.send(dialect.MAVLink_command_long_message(9, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0), Station(7, 1))
    bench.send(dialect.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0), Station(7, 1))
    bench.run(4.0)
    assert bench.texts() == ""


def test_item_numbers_are_the_stations(bench):
    bench.vessel.texts.append((Severity.WARNING, "Plan: item 1 leads out of the fence"))
    bench.tick()
    assert said(bench) == [f"Plan: item {1 + bench.shift} leads out of the fence"]
    bench.gcs.clear()
    bench.vessel.refuse[Arm] = Reply(Result.REJECTED_NOW, "item 0 is 41 m outside the fence")
    bench.long(400, 1)
    bench.tick(3)
    assert said(bench) == [f"Item {bench.shift} is 41 m outside the fence"]


@pytest.mark.parametrize(
    ("params", "name"),
    [((1, 1), "Acro"), ((1, 6), "Follow"), ((1, 4, 8), "Follow me"), ((1, 4, 6), "Land"), ((1, 99), "mode 99")],
)
def test_a_mode_that_this_boat_has_not_is_refused_by_its_name(bench, params, name):
    bench.long(176, *params)
    assert said(bench) == [f"{name[0].upper()}{name[1:]} is not one of this boat's modes"]
    assert bench.acked(176) == [2]


def test_a_refused_parameter_is_told_to_stations_that_know_no_param_error(bench):
    for name, value, kind in (("READ_ONLY", 8.0, 9), ("TEST_001", 1e11, 9), ("TEST_001", 1.0, 6)):
        bench.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    assert said(bench) == [
        "READ_ONLY is read-only",
        "TEST_001: 1e+11 m is outside -1e+10...1e+10",
        "TEST_001 is a REAL32",
    ]


@pytest.mark.parametrize(
    ("message", "word"),
    [
        (dialect.MAVLink_set_gps_global_origin_message(1, 411_000_000, -87_000_000, 0), "Global origin"),
        (
            dialect.MAVLink_follow_target_message(0, 0, 0, 0, 0, [0] * 3, [0] * 3, [0] * 4, [0] * 3, [0] * 3, 0),
            "Follow me",
        ),
        (dialect.MAVLink_vision_position_estimate_message(0, 0, 0, 0, 0, 0, 0), "Vision positions"),
    ],
)
def test_what_the_boat_cannot_do_and_has_no_acknowledgement_is_said_by_name_and_rarely(bench, message, word):
    for _ in range(50):
        bench.send(message)
        bench.tick()
    assert len([line for line in bench.texts().split("\n") if line.startswith(word)]) == 1


def test_with_the_guard_off_each_start_and_arming_says_so_and_nothing_speaks_of_margins():
    screen = Screen("depth.enabled=false")
    screen.run()
    screen.wait(4.0)
    off = [text for text in screen.texts(Severity.WARNING) if text.startswith("depth guard OFF")]
    assert off, "also told to a station that has just connected"
    screen.run(screen.client.start_mission())
    screen.run(screen.client.arm())
    screen.wait(1.0)
    assert len([text for text in screen.texts() if text.startswith("depth guard OFF")]) > len(off)
    assert not [text for text in screen.texts() if "margin" in text.lower()]


def test_what_is_good_or_an_operators_own_is_no_alarm():
    screen = Screen()
    screen.run()
    screen.wait(4.0)
    assert any("not ArduPilot" in text for text in screen.texts()), "seen in the window"
    screen.run(screen.client.arm())
    screen.wait(2.0)
    screen.run(screen.client.disarm())
    screen.wait(1.0)
    by_text = {text: severity for _, severity, text in screen.client.report.texts}
    assert by_text["armed"] == Severity.INFO
    told = [text for text in by_text if text.startswith(("disarmed", "An operator's stop"))]
    assert len(told) == 2
    assert all(by_text[text] == Severity.INFO for text in told)
    assert not [text for text, severity in by_text.items() if severity == Severity.NOTICE], (
        "a red triangle in QGroundControl"
    )
