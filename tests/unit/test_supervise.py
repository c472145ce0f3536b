"""A part that fails rests and is tried again; one that keeps failing is reported."""

from __future__ import annotations

from companion.supervise import Supervisor

SECOND = 1_000_000


def fail() -> int:
    raise ValueError("broken")


def test_row_04_rest_retry_and_report():
    said: list[str] = []
    watched = Supervisor(lambda severity, text: said.append(text))
    assert watched.call("gcs", 0, lambda: 7) == 7
    assert watched.call("gcs", 0, fail) is None
    assert said == ["gcs failed (ValueError), tried again in a second"]
    assert watched.call("gcs", SECOND - 1, lambda: 7) is None, "it rests"
    assert watched.call("other", 0, lambda: 8) == 8, "others do not"
    assert watched.call("gcs", SECOND, lambda: 7) == 7
    for i in range(1, 5):
        assert not watched.failing(i * SECOND)
        watched.call("gcs", i * SECOND, fail)
    assert watched.failing(4 * SECOND), "five in a minute"
    assert watched.failing(60 * SECOND)
    assert not watched.failing(61 * SECOND)
