"""What a station asks of the vessel, as a message of the link: a plan, a command word for word, a request, or one of the frozen stops."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass

from ...language.messages import Mode
from ...language.requests import LoadPlan, Origin, Reposition, RequestBody, SetMode
from ...language.units import rad_to_e7
from ..air.ledger import Ledger, Priority
from ..codec.command import encode_command
from ..codec.plan import Position, encode_plan
from ..codec.request import crosses, encode_request
from ..codec.wire import SAFE_STOPS, Kind
from ..link import CompactLink

Speaker = tuple[int, int] | None
"""System and component of a station; None: nobody on the network."""


@dataclass(slots=True)
class PendingOrder:
    """A request on the air, and who waits for its answer: the owners that were given with it, and their stations."""

    body: RequestBody
    owners: dict[Hashable, Speaker]


def superseded(pending: Mapping[int, PendingOrder], body: RequestBody, station: Speaker) -> set[int]:
    """Numbers of the modes that nobody wants any more; their station no longer waits for an answer.

    A station asks for another mode once it has given up the one before. An acknowledgement names no mode, so the answer to the older
    would be taken for the newer's. A stop is carried out all the same: the newer mode comes after it.
    """
    if not isinstance(body, SetMode) or station is None:
        return set()
    unwanted = set()
    for number, older in pending.items():
        if not isinstance(older.body, SetMode) or older.body == body:
            continue
        older.owners = {owner: speaker for owner, speaker in older.owners.items() if speaker != station}
        if not older.owners and not older.body.nature.stops:
            unwanted.add(number)
    return unwanted


def message_of(
    body: RequestBody, origin: Origin | None, address: tuple[int, int], near_e7: Position | None
) -> tuple[Kind, bytes]:
    """Kind and payload. ``address``: the vessel's system and component; ``near_e7``: where it is, as last known.

    Raises ValueError for what does not cross, PlanCodecError for a plan that cannot be told.
    """
    if isinstance(body, LoadPlan):
        return Kind.PLAN, encode_plan(body.kind, body.items, near_e7)
    safe = next((number for number, stop in SAFE_STOPS.items() if stop == body), None)
    if safe is not None:
        return Kind.SAFE, bytes((safe, 0 if origin is None else origin.source[0]))
    if not crosses(body):
        raise ValueError(f"{type(body).__name__} does not cross the radio link")
    payload = encode_request(body) if origin is None else encode_command(origin, address)
    return (Kind.STOP if body.nature.stops else Kind.ORDER), payload


def covers(pending: RequestBody, body: RequestBody) -> bool:
    """Whether an order that is on its way brings all that another one asks for.

    QGroundControl's go-to is three messages at once: DO_REPOSITION, mode Guided, and ArduPilot's guided item of the same place.
    """
    if pending == body:
        return True
    if not isinstance(pending, Reposition) or pending.lat_rad is None or not pending.change_mode:
        return False
    if isinstance(body, SetMode):
        return body.mode is Mode.GUIDED
    if not isinstance(body, Reposition):
        return False
    return (
        _place_e7(body) == _place_e7(pending)
        and body.speed_mps in (None, pending.speed_mps)
        and body.radius_m in (None, pending.radius_m)
    )


def _place_e7(body: Reposition) -> tuple[int, int] | None:
    if body.lat_rad is None or body.lon_rad is None:
        return None
    return rad_to_e7(body.lat_rad), rad_to_e7(body.lon_rad)


def stops_word(ledger: Ledger, now_us: int, *, at_most: int, spoken_for: int = 0) -> str:
    """How many stops the hour still holds, and with none what happens by itself; "" while there are more than ``at_most``."""
    left = ledger.stops_left(now_us)
    if left is None or (left := max(left - spoken_for, 0)) > at_most:
        return ""
    if left:
        return f"Radio: this hour holds {left} more stop{'s' * (left > 1)}"
    wait_us = ledger.wait_us((spoken_for + 1) * ledger.stop_us, Priority.STOP, now_us) or 0
    when = f" for {math.ceil(wait_us / 60e6)} min" if wait_us else ""
    return f"Radio: the last stop{when}; the vessel sails its plan to the end and holds there, its guards stay on"


def submit(link: CompactLink, message: tuple[Kind, bytes], now_us: int, *, is_stop: bool) -> int:
    """Hand a message to the link with the priority and the time that its kind has. Returns its number. Raises ValueError."""
    kind, payload = message
    settings = link.profile.link
    limit_s = settings.upload_s if kind is Kind.PLAN else settings.command_s
    priority = Priority.STOP if is_stop else Priority.COMMAND
    return link.submit(kind, payload, priority, now_us, round(limit_s * 1e6))
