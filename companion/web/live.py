"""What one browser is sent, and when: what has changed since the last, within a budget of bytes, and the newest always. No I/O."""

from __future__ import annotations

import json
from typing import Any, Final

from mavlink_bridge.language.traffic import VesselKind

BUDGET_BYTES_PER_S: Final = 3500.0
"""Below 4 kB/s with all that lies around it, so that a link of 50 kbit/s has room for the map and for orders."""
BURST_BYTES: Final = 9000.0
"""A first, whole picture with twenty texts."""
PERIOD_US: Final = 500_000
STALE_US: Final = 1_000_000
"""Without news a browser hears so often that there is none."""
_ROUND_S: Final = {"t_s": 1, "utc_s": 0}
_OTHERS: Final = 8
"""Other vessels on the page, beside persons: a kilobyte when all have moved."""
_PERSON: Final = VesselKind.PERSON.value
_LEFT_OUT: Final = frozenset({"heading_error_deg", "speed_error_mps", "rudders_deg", "output", "airtime"})
"""Fields of the picture that the page does not show."""


class Feed:
    """The stream to one browser. ``due`` gives the next event, or nothing yet."""

    def __init__(self, now_us: int) -> None:
        self._sent: dict[str, Any] = {}
        self._tokens = BURST_BYTES
        self._filled_us = now_us
        self._last_us = now_us - PERIOD_US

    def due(self, newest: dict[str, Any] | None, now_us: int) -> bytes:
        """Return an event of what is new in ``newest`` (fields of the page), or b"". None: nothing is known yet."""
        self._tokens = min(BURST_BYTES, self._tokens + (now_us - self._filled_us) * 1e-6 * BUDGET_BYTES_PER_S)
        self._filled_us = now_us
        if newest is None or now_us - self._last_us < PERIOD_US or self._tokens <= 0.0:
            return b""
        changed = {name: value for name, value in newest.items() if self._sent.get(name, ...) != value}
        if not changed and now_us - self._last_us < STALE_US:
            return b""
        self._last_us = now_us
        self._sent.update(changed)
        event = f"data: {json.dumps(changed, separators=(',', ':'), ensure_ascii=False)}\n\n".encode()
        self._tokens -= len(event)
        return event


def page_fields(picture: dict[str, Any]) -> dict[str, Any]:
    """A picture as the page shows it: without what it does not show, and no finer than it shows."""
    found = {name: value for name, value in picture.items() if name not in _LEFT_OUT}
    for name, digits in _ROUND_S.items():
        if isinstance(found.get(name), float):
            found[name] = round(found[name], digits)
    found["links"] = [_link(link) for link in picture.get("links", [])]
    found["texts"] = [
        [each["number"], each["t_s"], each["severity"], each["text"]] for each in picture.get("texts", [])
    ]
    others = picture.get("others", [])
    persons = [each for each in others if each["kind"] == _PERSON]
    vessels = [each for each in others if each["kind"] != _PERSON]
    found["others"] = [_other(each) for each in (*persons, *vessels[:_OTHERS])]
    found["failsafes"] = [_failsafe(each) for each in picture.get("failsafes", [])]
    return found


def _other(each: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of another vessel: to the metre, and her age from a minute on in tens of seconds."""
    names = (
        "title",
        "kind",
        "danger",
        "course_deg",
        "speed_mps",
        "at_rest",
        "length_m",
        "range_m",
        "bearing_deg",
        "sentence",
    )
    found = {name: each[name] for name in names if each[name] not in (None, "") and each[name] is not False}
    age_s = int(each["age_s"])
    found["age_s"] = age_s if age_s < 60 else age_s // 10 * 10
    found["at"] = [round(each["lat_deg"], 5), round(each["lon_deg"], 5)]
    return found


def _link(link: dict[str, Any]) -> list[Any]:
    """Name, kind, open, and how long ago it was heard: in whole seconds, from ten on in tens."""
    age_s = link.get("age_s")
    if age_s is not None:
        age_s = int(age_s) if age_s < 10.0 else int(age_s) // 10 * 10
        age_s = age_s if age_s >= 3 else 0
    return [link["name"], link["kind"], link["is_open"], age_s]


def _failsafe(each: dict[str, Any]) -> dict[str, Any]:
    """What the page shows of one, its countdown in whole seconds as all other places have it."""
    found = {name: each[name] for name in ("name", "cause", "doing", "next", "next_in_s", "runs", "until")}
    if found["next_in_s"] is not None:
        found["next_in_s"] = round(max(found["next_in_s"], 0.0))
    return found
