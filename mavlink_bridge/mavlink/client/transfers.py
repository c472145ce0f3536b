"""Plans, fences and rally points to and from a vehicle, as jobs. Source: MAVLink mission protocol; the stations' times, gcs §4.

Items are canonical: a vehicle that counts a home item gets one in front. A vehicle asks again for what was lost; what we said last is
repeated too, because its acknowledgement may be what was lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from ...language.requests import PlanItem, PlanKind
from ..missions.plan_rules import MissionResult
from ..missions.wire import item_from_message, item_to_message, with_home, without_home
from ..wire.codec import dialect
from .exchange import DONE, Job, JobOutcome, Step
from .orders import REASON_S
from .texts import Texts
from .vehicle import HeardVehicle

COUNT_S: Final = 1.0
COUNT_TRIES: Final = 12
ITEM_S: Final = 1.5
REQUEST_S: Final = 0.5
REQUEST_TRIES: Final = 20
"""Of a radio that loses every third frame one transfer in a thousand fails."""


def upload(
    vehicle: HeardVehicle,
    kind: PlanKind,
    items: Sequence[PlanItem],
    home_rad: tuple[float, float] | None = None,
    *,
    texts: Texts,
    answer_s: float,
) -> Job:
    """Send a plan. ``answer_s``: how long the vehicle may take to store it, counted from its newest sign."""
    content = tuple(items)
    if kind is PlanKind.MISSION and vehicle.home_item:
        content = with_home(content, home_rad)
    since, tries = texts.count, max(1, round(answer_s / ITEM_S))
    to = {"target_system": vehicle.system, "target_component": vehicle.component}
    last: Any = dialect.MAVLink_mission_count_message(count=len(content), mission_type=kind.value, **to)
    allowed, wait_s = COUNT_TRIES if content else tries, COUNT_S
    while True:
        answer = yield Step(_saying(last), lambda message: _is_about(message, kind), wait_s, allowed)
        if answer is None:
            return JobOutcome(False, "the vehicle does not take the plan: no answer")
        if answer.get_type() == "MISSION_ACK":
            return (yield from _ended(answer.type, texts, since))
        if answer.seq < len(content):
            last = item_to_message(content[answer.seq], answer.seq, vehicle.system, vehicle.component, kind)
        allowed, wait_s = tries, ITEM_S


def _saying(message: Any) -> Any:
    return lambda _: (message,)


def _is_about(message: Any, kind: PlanKind) -> bool:
    names = ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK")
    return message.get_type() in names and message.mission_type == kind.value


def _ended(result: int, texts: Texts, since: int) -> Job:
    if result == MissionResult.ACCEPTED:
        return DONE
    yield Step(lambda _: (), lambda _: False, REASON_S)
    known = {each.value: each.name.replace("_", " ").lower() for each in MissionResult}
    return JobOutcome(False, texts.reasons(since) or f"plan refused: {known.get(result, f'result {result}')}")


def download(vehicle: HeardVehicle, kind: PlanKind, into: list[PlanItem]) -> Job:
    """Fetch a plan's canonical items ``into`` a list, which is emptied first."""
    into.clear()
    to = {"target_system": vehicle.system, "target_component": vehicle.component, "mission_type": kind.value}
    asked = dialect.MAVLink_mission_request_list_message(**to)
    count = yield Step(_saying(asked), lambda message: _is_count(message, kind), COUNT_S, COUNT_TRIES)
    if count is None:
        return JobOutcome(False, "the vehicle does not say what plan it has")
    items: list[PlanItem] = []
    for seq in range(count.count):
        wanted = dialect.MAVLink_mission_request_int_message(seq=seq, **to)
        item = yield Step(_saying(wanted), _item_of(kind, seq), REQUEST_S, REQUEST_TRIES)
        if item is None:
            return JobOutcome(False, f"item {seq} of the vehicle's plan did not come")
        items.append(item_from_message(item))
    yield Step(_saying(dialect.MAVLink_mission_ack_message(type=0, **to)), lambda _: False, 0.0)
    strip = kind is PlanKind.MISSION and vehicle.home_item
    into += without_home(tuple(items)) if strip else items
    return DONE


def _is_count(message: Any, kind: PlanKind) -> bool:
    return bool(message.get_type() == "MISSION_COUNT" and message.mission_type == kind.value)


def _item_of(kind: PlanKind, seq: int) -> Any:
    def wants(message: Any) -> bool:
        is_item = message.get_type() == "MISSION_ITEM_INT" and message.seq == seq
        return bool(is_item and message.mission_type == kind.value)

    return wants
