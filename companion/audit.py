"""Who ordered what: every order that reaches the vessel, with its sender, link, proof and outcome, for the run's events.

A system id is a claim; what stands behind it is the link it came over and what was proved there. Streams (sticks, set-points) are
noted when they begin and when they are refused, not at each of their messages.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable
from enum import Enum
from typing import Any, Final, Protocol

from mavlink_bridge.language.requests import (
    Arm,
    DistanceInput,
    LoadPlan,
    Reply,
    Request,
    RequestBody,
    RtcmData,
    SetMode,
)
from mavlink_bridge.language.stations import Proof, Station

STREAM_GAP_US: Final = 5_000_000
"""A stream that was silent for so long begins anew: as long as a ground station may be silent before it counts as lost."""
_MAX_STREAMS: Final = 32
ABOARD: Final = "a program aboard"
"""Who orders over no link and names nobody."""
_DATA: Final = (RtcmData, DistanceInput)
"""What measures, and orders nothing."""
Answer = Callable[[Reply], None]


class Diary(Protocol):
    """Where orders are written down."""

    def order(self, t_us: int, fields: dict[str, Any]) -> None: ...


class Audit:
    """Notes orders for one vessel. ``diary`` None: nowhere."""

    def __init__(self) -> None:
        self.diary: Diary | None = None
        self._streams: dict[tuple[Any, ...], tuple[int, str]] = {}
        """Newest message of each stream, and how it was answered."""

    def noting(self, request: Request, answer: Answer, now_us: int) -> Answer:
        """Return ``answer`` so that it notes the order and its outcome too."""
        if self.diary is None or isinstance(request.body, _DATA):
            return answer

        def noted(reply: Reply) -> None:
            if request.reply or self._is_news(request, reply, now_us):
                self._note(request, reply, now_us)
            answer(reply)

        return noted

    def _is_news(self, request: Request, reply: Reply, now_us: int) -> bool:
        """Whether a stream has begun, or is answered otherwise than before."""
        key = request.station, type(request.body)
        last_us, result = self._streams.pop(key, (None, ""))
        self._streams[key] = now_us, reply.result.name
        if len(self._streams) > _MAX_STREAMS:
            del self._streams[next(iter(self._streams))]
        return last_us is None or now_us - last_us > STREAM_GAP_US or result != reply.result.name

    def _note(self, request: Request, reply: Reply, now_us: int) -> None:
        station = request.station
        fields: dict[str, Any] = {"order": words(request.body), "result": reply.result.name}
        if reply.reason:
            fields["reason"] = reply.reason
        if station is None:
            fields["link"] = "aboard"
        elif station.bystander:
            fields |= {"link": station.link, "host": station.host, "proof": request.proof.value}
        else:
            fields |= {"system": request.sender, "component": request.component, "link": station.link}
            fields |= {"host": station.host, "proof": request.proof.value}
        if self.diary is not None:
            self.diary.order(now_us, fields)


def own_request(body: RequestBody, station: Station | None) -> Request:
    """A request that came over no link: the vessel's own people's, or one that the page's key stands behind."""
    proof = Proof.UNSIGNED if station is None else Proof.PAGE_KEY
    return Request(0, body, sender=0, station=station, proof=proof)


def ordered_text(body: RequestBody, station: Station) -> str:
    """What everybody is told of an order that came over no link."""
    return f"{body.mode.value if isinstance(body, SetMode) else words(body).capitalize()}: ordered by {station}"


def whom(request: Request) -> str:
    """Who ordered, in words: its ids, link and what proves it."""
    if request.station is None:
        return ABOARD
    return f"{request.sender}/{request.component} over {request.station.link} ({request.proof.value})"


def words(body: RequestBody) -> str:
    """An order in words: its name and what it says, angles in degrees."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", type(body).__name__).lower()
    if isinstance(body, Arm):
        return f"{'arm' if body.arm else 'disarm'}{' by force' * body.force}"
    if isinstance(body, LoadPlan):
        return f"{name} {body.kind.name.lower()} of {len(body.items)} items"
    told = [_told(item.name, getattr(body, item.name)) for item in dataclasses.fields(body)]
    return " ".join([name, ", ".join(part for part in told if part)]).rstrip()


def _told(name: str, value: Any) -> str:
    """One value of an order; empty for what is not given."""
    if value is None:
        return ""
    if isinstance(value, Enum):
        return f"{name} {value.name.lower()}"
    if isinstance(value, bool):
        return name if value else f"not {name}"
    if isinstance(value, float) and name.endswith("_rad"):
        return f"{name.removesuffix('_rad')} {math.degrees(value):.7g} deg"
    if isinstance(value, float):
        return f"{name} {value:.7g}"
    return f"{name} {value}" if isinstance(value, int | str) else ""
