"""The panel and the journal: everything fits 80 x 24, the newest alarms are never hidden, and the journal has every line."""

from __future__ import annotations

import io
import logging
import os
import threading

import pytest
from hypothesis import given, settings, strategies as st

from companion.commands.log_lines import NeverWaiting
from companion.commands.status import Journal, StatusView, panel
from companion.commands.status.view import Screen
from companion.status.picture import LinkSeen, Picture, ToldText, Warned, picture_of
from mavlink_bridge.language.messages import Action, LogText, Mode, Severity
from mavlink_bridge.language.snapshot import Outlook
from tests.unit.test_status import snapshot

words = st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "Zs")), max_size=300)
warned = st.builds(Warned, name=words, cause=words, doing=words, sentence=words)
links = st.builds(
    LinkSeen, name=words, kind=st.sampled_from(["nmea", "endpoint"]), is_open=st.booleans(), age_s=st.none(), text=words
)
severities = st.sampled_from([each.name for each in Severity])


def numbered(texts: list[tuple[str, str]]) -> tuple[ToldText, ...]:
    return tuple(ToldText(number, 3600.0, severity, text) for number, (severity, text) in enumerate(texts))


pictures = st.builds(
    Picture,
    t_s=st.floats(0, 1e6),
    now=words,
    next=st.lists(words, max_size=8).map(tuple),
    failsafes=st.lists(warned, max_size=20).map(tuple),
    not_ready=st.lists(words, max_size=20).map(tuple),
    links=st.lists(links, max_size=30).map(tuple),
    texts=st.lists(st.tuples(severities, words), max_size=20).map(numbered),
    airtime=words,
    fence_on=st.booleans(),
)


@settings(max_examples=150, deadline=None)
@given(pictures, st.integers(80, 200), st.integers(24, 60), words.filter(str.strip))
def test_every_picture_fits_and_shows_the_newest_alarm(picture: Picture, width: int, height: int, alarm: str) -> None:
    newest = ToldText(1000, 7200.0, "CRITICAL", "Newest alarm")
    chatter = tuple(ToldText(1001 + number, 7201.0, "INFO", alarm) for number in range(10))
    lines = panel(_with(picture, (*picture.texts, newest, *chatter)[-20:]), width, height)
    assert len(lines) <= height
    assert all(12 + len(each.text) <= width and len(each.label) <= 11 for each in lines)
    assert any("Newest alarm" in each.text for each in lines)
    assert lines[1].label == "Now"


def _with(picture: Picture, texts: tuple[ToldText, ...]) -> Picture:
    picture.texts = texts
    return picture


def test_a_screen_of_24_lines_holds_a_bad_day() -> None:
    bad = tuple(
        Outlook(name, cause, "holding", Action.RETURN, 48.0, True, "until ground station is back, then order Auto")
        for name, cause in (("gcs_lost", "ground station lost"), ("battery_low", "battery low"), ("x", "y"))
    )
    texts = tuple(LogText(number, 0, Severity.WARNING, f"warning {number} " + "w" * 60) for number in range(20))
    shown = panel(picture_of(snapshot(action=Action.HOLD, outlook=bad, causes=("gcs_lost",)), texts), 80, 24)
    told = "\n".join(each.text for each in shown)
    assert len(shown) <= 24
    assert "RETURNS in 48 s unless ground station is back" in told
    assert "warning 19" in told
    assert "41.185000°" in told


def test_a_terminal_is_redrawn_in_place() -> None:
    out = io.StringIO()
    screen = Screen(out)
    for _ in range(3):
        screen.draw(picture_of(snapshot()))
    height = out.getvalue().split("\x1b[J")[0].count("\n")
    assert out.getvalue().count(f"\x1b[{height}F") == 2
    assert height < 24


def test_the_journal_gets_every_text_mode_arming_and_failsafe(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    journal = Journal()
    outlook = (Outlook("gcs_lost", "ground station lost", "holding", Action.RETURN, 60.0, True, "until it is back"),)
    day = [
        snapshot(0, armed=False, mode=Mode.HOLD),
        snapshot(1, mode=Mode.HOLD, texts=(LogText(1, 1, Severity.INFO, "armed"),)),
        snapshot(2, texts=(LogText(2, 2, Severity.CRITICAL, "Ground station lost: HOLD"),)),
        snapshot(3, action=Action.HOLD, causes=("gcs_lost",), outlook=outlook, mode=Mode.HOLD),
        snapshot(4, mode=Mode.HOLD),
        snapshot(5, armed=False, mode=Mode.HOLD),
    ]
    for each in day:
        journal.update(each)
    journal.close()
    assert caplog.messages == [
        "mode Hold, disarmed",
        "info: armed",
        "mode Hold, armed (was Hold, disarmed)",
        "critical: Ground station lost: HOLD",
        "mode Auto, armed (was Hold, armed)",
        "mode Hold, armed (was Auto, armed)",
        "failsafe HOLD: ground station lost: holding, RETURN in 60 s; until it is back",
        "failsafe NONE",
        "mode Hold, disarmed (was Hold, armed)",
    ]
    levels = {record.getMessage(): record.levelno for record in caplog.records}
    assert levels["critical: Ground station lost: HOLD"] == logging.ERROR


def test_a_flood_of_texts_fills_no_card(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    journal = Journal()
    for second in range(20):
        texts = tuple(LogText(number, 0, Severity.INFO, "again") for number in range(100))
        journal.update(snapshot(second * 1_000_000, texts=texts))
    assert len(caplog.messages) < 130
    assert any("more lines were left out" in text for text in caplog.messages)


def test_a_reader_that_has_stopped_does_not_stop_the_writer() -> None:
    """The pipe to a pager that somebody has left standing: a full one takes no line, and says so when it is read again."""
    reading, writing = os.pipe()
    with os.fdopen(writing, "w", encoding="utf-8") as out, os.fdopen(reading, "rb", buffering=0) as reader:
        handler = NeverWaiting(out)
        record = logging.LogRecord("x", logging.INFO, "", 0, "line %s", ("l" * 500,), None)
        for _ in range(1000):
            handler.emit(record)
        held = reader.read(1 << 20)
        assert held is not None
        assert len(held) < 100_000
        handler.emit(record)
        found = b""
        while b"lines were left out: nobody read" not in found:
            found += reader.read(1 << 20)


def test_a_terminal_that_stands_does_not_stop_the_loop() -> None:
    """Ctrl-S, or a stalled ssh line, under way: the loop had waited in a write, and 30 s later the boat was disarmed for it."""
    reader, terminal = os.openpty()
    with os.fdopen(terminal, "w", encoding="utf-8") as out, os.fdopen(reader, "rb", buffering=0) as screen:
        view = StatusView(out, plain=False)

        def sail() -> None:
            for tick in range(300):
                view.update(snapshot(tick * 250_000))

        loop = threading.Thread(target=sail, daemon=True)
        loop.start()
        loop.join(10.0)
        assert not loop.is_alive()
        assert screen.read(1 << 20).startswith(b"\x1b[2K")
        view.close()
