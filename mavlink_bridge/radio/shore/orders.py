"""What a station asks of the vessel, as a message of the link: a plan, a command word for word, a request, or one of the frozen stops."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Final

from ...language.messages import Mode
from ...language.nature import takes_back
from ...language.requests import LoadPlan, Origin, PlanKind, Reply, Reposition, RequestBody, Result, SetMode
from ...language.units import rad_to_e7
from ...mavlink.missions.plan_rules import plan_id
from ..air.ledger import Ledger, Priority
from ..codec.command import encode_command
from ..codec.plan import Position, encode_plan
from ..codec.request import crosses, encode_request
from ..codec.state_fields import plan_hash
from ..codec.wire import SAFE_STOPS, Kind
from ..link import CompactLink

_SLOW_S: Final = 3
"""From this time on between two tries an operator should know of it: usually there are two in a second and a half."""
OVERTAKEN: Final = Reply(Result.REJECTED_NOW, "overruled by a newer order")


@dataclass(slots=True)
class PendingOrder:
    """A request on the air, and who waits for its answer: the owners that were given with it, and their stations."""

    body: RequestBody
    owners: dict[Hashable, Hashable]
    is_taken_back: bool = False
    """Whether somebody has ordered the contrary since: who asks for it again means it anew."""


class PendingOrders:
    """Those of one shore that have no answer yet, by their numbers on the air."""

    def __init__(self) -> None:
        self._orders: dict[int, PendingOrder] = {}

    def pop(self, number: int) -> PendingOrder | None:
        """Forget one that has ended; None for what was replaced, or is no order."""
        return self._orders.pop(number, None)

    def is_on_its_way(self, kind: PlanKind) -> bool:
        """Whether a plan is being uploaded: that the vessel has it, and the answer has not come, is no difference to ask for."""
        return any(isinstance(each.body, LoadPlan) and each.body.kind is kind for each in self._orders.values())

    def changes_of_another(self, number: int) -> set[int]:
        """Numbers of the changes of a part of a plan while neither their base nor what they make of it is aboard. ``number``: of the plan
        aboard, as a state tells it.
        """
        return {key for key, order in self._orders.items() if number not in _hashes(order.body, number)}

    @property
    def yielding(self) -> set[int]:
        """Numbers of those that a stop makes void."""
        return {number for number, order in self._orders.items() if order.body.nature.yields}

    def unwanted(self, body: RequestBody, station: Hashable) -> set[int]:
        """Numbers of the orders that their only station takes back by this one: they must not be carried out after it.

        A stop is carried out all the same: what takes it back comes after it. A plan is heard to the end: its station waits for it.
        """
        return {
            number
            for number, older in self._orders.items()
            if takes_back(body, older.body)
            and not covers(older.body, body)
            and not older.body.nature.stops
            and not isinstance(older.body, LoadPlan)
            and station is not None
            and all(speaker == station for speaker in older.owners.values())
        }

    def join(self, owner: Hashable, body: RequestBody, station: Hashable) -> int | None:
        """Let somebody wait for the answer to what is on its way already, if nobody has ordered the contrary since. Returns its number."""
        for number, order in self._orders.items():
            if covers(order.body, body) and not order.is_taken_back:
                order.owners[owner] = station
                return number
        return None

    def put(self, number: int, body: RequestBody, owner: Hashable, station: Hashable) -> set[int]:
        """Note what goes on the air. Returns the numbers of those that it stands for, whose owners it takes over.

        That are the same order from before its contrary, and a clearing, which must not be carried out after the plan that follows it.
        """
        order = PendingOrder(body, {})
        replaced = {
            old
            for old, older in self._orders.items()
            if (older.is_taken_back and older.body == body) or _is_cleared_by(older.body, body)
        }
        for old in replaced:
            order.owners |= self._orders.pop(old).owners
        for older in self._orders.values():
            older.is_taken_back |= takes_back(body, older.body)
        order.owners[owner] = station
        self._orders[number] = order
        return replaced


def _hashes(body: RequestBody, number: int) -> tuple[int, ...]:
    """What states tell of the plan aboard before and after a change; of all that is no change of a plan ``number``."""
    if not isinstance(body, LoadPlan) or body.kind is not PlanKind.MISSION or body.base_id is None:
        return (number,)
    return plan_hash(body.base_id), plan_hash(plan_id(body.items))


def _is_cleared_by(older: RequestBody, body: RequestBody) -> bool:
    """Whether ``older`` only makes room that ``body`` makes itself."""
    if not (isinstance(older, LoadPlan) and isinstance(body, LoadPlan)):
        return False
    return older.kind is body.kind and not older.items


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


def words_at_a_stop(link: CompactLink, now_us: int) -> tuple[str, ...]:
    """What is told with a stop: what the hour still holds; and while nobody answers how repeats slow down before it is spent."""
    wait_s = math.ceil(link.patience.stop_wait_us(now_us, again=False) / 1e6)
    every_s = round(link.patience.repeats_us(now_us) / 1e6)
    slow = f"Radio: nobody answers; lest the hour's airtime is spent, a stop is repeated every {every_s} s"
    put_off = f"Radio: nobody answers, and the hour's airtime is nearly spent: this stop goes out in {wait_s} s"
    left = stops_word(link.ledger, now_us, at_most=3, spoken_for=1)
    return left, put_off if wait_s >= _SLOW_S else slow if every_s >= _SLOW_S else ""


def submit(link: CompactLink, message: tuple[Kind, bytes], now_us: int, *, is_stop: bool) -> int:
    """Hand a message to the link with the priority and the time that its kind has. Returns its number. Raises ValueError."""
    kind, payload = message
    settings = link.profile.link
    limit_s = settings.upload_s if kind is Kind.PLAN else settings.command_s
    priority = Priority.STOP if is_stop else Priority.COMMAND
    return link.submit(kind, payload, priority, now_us, round(limit_s * 1e6))
