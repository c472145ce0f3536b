"""Every row of the failsafe table that grows or waits for an order is foretold: as text, on the terminal, on the page, in the report."""

from __future__ import annotations

import pytest

from companion.commands.status import panel
from companion.core.guard.failsafe_table import TABLE, Clear, Condition
from companion.core.guard.outlook import outlook
from companion.report.flight import Event
from companion.report.story import tell
from companion.status.picture import fields_of, picture_of
from companion.web.live import page_fields
from mavlink_bridge.language.messages import Action, LogText, Severity
from tests.unit.test_failsafe import CONFIG, WELL, Run, raised
from tests.unit.test_status import snapshot

ROWS = [row for row in TABLE if row.then_action is not Action.NONE or row.clear is not Clear.GONE]
ORDERS = {
    Clear.OPERATOR: "then order Auto",
    Clear.ACTED: "then order Auto",
    Clear.REARM: "then arm again",
    Clear.RESTART: "until the program is started again",
    Clear.GONE: "",
}


def fired(row: Condition) -> tuple[Run, list[tuple[Severity, str]]]:
    """The row has just acted: the engine, and the texts that it gave."""
    run, texts = Run(), list[tuple[Severity, str]]()
    run.step(WELL)
    for after_s in (0.05, row.delay_s if row.age is None else 0.0):
        run.step(raised(row.name), after_s)
        assert run.last is not None
        texts += run.last.texts
    assert row.name in run.causes
    return run, texts


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_what_comes_and_what_ends_it_is_told_everywhere(row: Condition) -> None:
    run, said = fired(row)
    texts = [text for _, text in said]
    looks = outlook(run.memory, raised(row.name), run.now_us, CONFIG)
    logged = tuple(LogText(number, 0, *each) for number, each in enumerate(said))
    shown = snapshot(0, outlook=looks, causes=run.causes, action=run.last.action, texts=logged)  # type: ignore[union-attr]
    picture = picture_of(shown, logged)
    terminal = " ".join(each.text for each in panel(picture, 80, 24))
    on_page = next(each for each in page_fields(fields_of(picture))["failsafes"] if each["cause"] == row.text)
    report = " ".join(
        moment.text for moment in tell(Event(0.0, "text", text, severity.name) for severity, text in said)
    )
    told = " ".join(texts).lower()
    order = ORDERS[row.clear]
    for place in (told, terminal, on_page["until"], report.lower()):
        assert order.lower() in place.lower()
    if row.then_after_s is not None:
        assert f"{row.then_action.name} in {row.then_after_s:g} s" in " ".join(texts)
        assert f"{row.then_action.name} in {row.then_after_s:.0f} s" in terminal
        assert (on_page["next"], on_page["next_in_s"]) == (row.then_action.name, row.then_after_s)
        assert any(f" in {row.then_after_s:.0f} s" in text for text in picture.next), (
            "in the line that says what is next"
        )
        assert f"{row.then_action.name} in {row.then_after_s:g} s".lower() in report.lower()


@pytest.mark.parametrize("row", [row for row in ROWS if row.then_after_s is not None], ids=lambda row: row.name)
def test_the_countdown_runs_and_stands_with_its_cause(row: Condition) -> None:
    run, _ = fired(row)

    def left_s(cause: bool) -> float:
        flags = raised(row.name) if cause else WELL
        run.step(flags, 2.0)
        looks = outlook(run.memory, flags, run.now_us, CONFIG)
        found = next((each for each in looks if each.name == row.name), None)
        assert found is not None
        assert found.next_in_s is not None
        return found.next_in_s

    first = left_s(cause=True)
    assert first == pytest.approx((row.then_after_s or 0.0) - 2.0, abs=0.1)
    assert left_s(cause=True) == pytest.approx(first - 2.0, abs=0.1)
    if row.clear is not Clear.GONE and row.clear is not Clear.ACTED:
        stood = left_s(cause=False)
        assert left_s(cause=False) == pytest.approx(stood, abs=0.1)
