"""The original installation's way over the radio: a JSON plan in, JSON states out, with an answer to each plan.

A plan is loaded, the vessel armed if it is not, and the plan started: what the original did with a plan that came by
radio. Nothing here proves who sent it; the checks before arming still hold. The last order again within a minute is
answered, not sailed anew, if it was accepted; one that stops the vessel is always carried out, and ends what is under
way. An order that is accepted, and nothing else, counts as the operator's presence, for the radio's time-out. What comes is told
aboard: accepted, refused and why, or no plan at all. What a boat says, another one or this one by an echo, is no order and is
never answered: two boats in hearing of each other would else talk for ever.
"""

from __future__ import annotations

import json
import math
import zlib
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from ..language.messages import Mode, Severity
from ..language.requests import Arm, LoadPlan, PlanKind, Reply, Request, RequestBody, Result, SetMode, StartPlan
from ..language.snapshot import Snapshot
from ..language.stations import ONE_VOICE
from ..language.units import KNOT_MPS
from ..mavlink.missions.plan_export import items_from_maneuvers
from ..mavlink.missions.plan_mapping import load_plan
from ..mavlink.missions.plan_rules import PlanError, plan_id
from ..plans.seed_json import SeedJsonError, parse, read_json
from .air import AirClock, Ledger, Priority, RadioProfile
from .air.ledger import HOUR_US
from .codec.json_stream import JsonStream
from .codec.request import OVERRULED

_AGAIN_US: Final = 60_000_000
_MAX_WAITING: Final = 8
_PAUSE_US: Final = 30_000
_LISTEN_US: Final = 300_000
_STATE_SHARE: Final = 0.6
_GARBLED_GAP_US: Final = 60_000_000
_REFUSED_GAP_US: Final = 5_000_000
"""Whoever transmits can make the vessel refuse: texts that matter more must not drown in that."""
_OTHER_BOAT_GAP_US: Final = 600_000_000
"""A boat in hearing stays there; one word of it in so long is enough."""
_REFUSALS: Final = 4
"""So many on the air at once: a person who mends a plan by what it says sends it a few times."""
_REFUSAL_US: Final = 60_000_000
"""After so long there is one more: at 656 bit/s a refusal a minute is a quarter of the hour at 10 %, whoever sends what."""
_OF_A_STATE: Final = frozenset(("maneuver_id", "yaw_deg"))
"""Keys of a state that no plan has."""
_ACK: Final = "ack"
"""The key that only an answer has."""
_OTHER_BOAT: Final = "Radio: a boat's own words come in (another boat, or an echo): no order, not answered"


def state_json(snapshot: Snapshot, name: str, maneuver: str | None) -> bytes:
    """The eleven fields of a state, one line. Angles in degrees, speed in knots, unknown = null."""
    state, path = snapshot.state, snapshot.path
    target = (path.orbit_lat_rad, path.orbit_lon_rad)
    if target[0] is None:
        target = (path.target_lat_rad, path.target_lon_rad)
    yaw = _degrees(state.psi_rad, 1)
    when = None
    if snapshot.utc_us is not None:
        when = datetime.fromtimestamp(snapshot.utc_us // 1_000_000, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    place = {"lat": _degrees(target[0], 6), "lon": _degrees(target[1], 6)}
    fields: dict[str, Any] = {
        "id": name,
        "maneuver_id": maneuver,
        "location": None if target[0] is None else place,
        "latitude": _degrees(state.lat_rad, 7),
        "longitude": _degrees(state.lon_rad, 7),
        "z": 0.0,
        "speed_kn": None if state.sog_mps is None else round(state.sog_mps / KNOT_MPS, 1),
        "yaw_deg": None if yaw is None else yaw % 360.0,
        "pitch_deg": _degrees(state.theta_rad, 1),
        "roll_deg": _degrees(state.phi_rad, 1),
        "datetime": when,
    }
    return json.dumps(fields, separators=(",", ":")).encode() + b"\n"


def _degrees(angle_rad: float | None, digits: int) -> float | None:
    return None if angle_rad is None else round(math.degrees(angle_rad), digits)


@dataclass(slots=True)
class _Order:
    """A plan on its way through the vessel: the steps that are left, and the answer at the end."""

    name: str
    mark: int
    steps: deque[RequestBody]
    waiting: int = 0
    result: str = ""
    """How it ended; empty while it is under way."""
    answer: bytes = b""
    at_us: int = 0
    stops: bool = False

    @property
    def priority(self) -> Priority:
        """Of its answer: a stop's may use what is kept of the hour."""
        return Priority.STOP if self.stops else Priority.COMMAND


class JsonRadio:
    """The ``json`` protocol of the radio port, with the interface of an endpoint."""

    def __init__(
        self,
        profile: RadioProfile,
        name: str = "usv",
        ledger: Ledger | None = None,
        *,
        say: Callable[[Severity, str], None] = lambda severity, text: None,
    ) -> None:
        """``say``: for the people aboard."""
        self.profile = profile
        self._say = say
        self._present_us: int | None = None
        """When an order was last accepted."""
        self._garbled = 0
        self._garbled_us: int | None = None
        self._refused_us: int | None = None
        self.name = name
        self.ledger = ledger or Ledger(profile.hour_us)
        self._clock = AirClock(profile)
        self._stream = JsonStream()
        self._snapshot: Snapshot | None = None
        self.asked: list[Request] = []
        """What is asked of the vessel since the last ``requests``, oldest first."""
        self._next_id = 1
        self._orders: list[_Order] = []
        self._names: dict[int, str] = {}
        self._answers: deque[tuple[Priority, bytes]] = deque(maxlen=_MAX_WAITING)
        self._refused_until_us = 0
        """By when each refusal that went out has had its minute."""
        self._other_boat_us: int | None = None
        self._last_state_us: int | None = None
        self._heard_us: int | None = None

    @property
    def bad_frames(self) -> int:
        return self._stream.bad + self._stream.stray_bytes

    @property
    def heard(self) -> Mapping[tuple[int, int], int]:
        """Who sends an order that the vessel takes is there; one that is being carried out counts until it is refused."""
        stamps = [order.at_us for order in self._orders if order.waiting]
        if self._present_us is not None:
            stamps.append(self._present_us)
        return {ONE_VOICE: max(stamps)} if stamps else {}

    def param_changed(self, name: str) -> None:
        """The format has no parameters."""

    def receive(self, data: bytes, now_us: int) -> None:
        """Take bytes as read. Never raises on input."""
        if data:
            self._heard_us = now_us
        for value in self._stream.receive(data, now_us):
            self._take_up(value, now_us)
        self._note_garbled(now_us)

    def _note_garbled(self, now_us: int) -> None:
        """Tell aboard, now and then, that bytes come which are no order: a wrong rate or parity looks like this."""
        garbled = self._stream.bad + self._stream.stray_bytes
        is_due = self._garbled_us is None or now_us - self._garbled_us >= _GARBLED_GAP_US
        if garbled == self._garbled or not is_due:
            return
        self._garbled, self._garbled_us = garbled, now_us
        bad, stray = self._stream.bad, self._stream.stray_bytes
        self._say(Severity.WARNING, f"Radio: no JSON in what comes: {stray} stray bytes, {bad} broken values so far")

    def requests(self) -> list[Request]:
        requests = self.asked.copy()
        self.asked.clear()
        return requests

    def reply(self, request_id: int, reply: Reply, now_us: int) -> None:
        """Go on with an order, or end it with the answer that the sender gets."""
        order = next((item for item in self._orders if item.waiting == request_id), None)
        if order is None:
            return
        order.waiting = 0
        if reply.result is Result.ACCEPTED and order.steps:
            self._ask_next(order)
        else:
            self._end(order, reply.result.value, reply.reason, now_us)

    def tick(self, now_us: int, snapshot: Snapshot) -> None:
        self._snapshot = snapshot

    def take(self, now_us: int, limit_bytes: int) -> bytes:
        """Return the next line when the air is free: answers first, then a state when one is due. Lines are not cut."""
        if not self._clock.is_free(now_us) or self._is_listening(now_us):
            return b""
        if self._answers:
            return self._an_answer(now_us)
        line = self._state_due(now_us)
        if not line or not self._spend(len(line), Priority.STATE, now_us):
            return b""
        self._last_state_us = now_us
        return line

    def _an_answer(self, now_us: int) -> bytes:
        """The oldest for which the hour has room: a stop's does not wait behind one that has none."""
        for answer in self._answers:
            priority, line = answer
            if self._spend(len(line), priority, now_us):
                self._answers.remove(answer)
                return line
        return b""

    def state_interval_us(self, size: int) -> int:
        """Time between states of this size that the hour allows."""
        wanted_us = round(self.profile.link.state_s * 1e6)
        span_us = self._clock.span_us(size) + _LISTEN_US
        if self.ledger.limit_us is None:
            return max(wanted_us, 2 * span_us)
        return max(
            wanted_us,
            2 * span_us,
            int(self._clock.airtime_us(size) * HOUR_US / (self.ledger.limit_us * _STATE_SHARE)),
        )

    # ---- plans --------------------------------------------------------------------------------------------------

    def _take_up(self, value: bytes, now_us: int) -> None:
        if _is_a_boats_word(value):
            self._note_other_boat(now_us)
            return
        stops = _stops(value)
        order = _Order(_name_in(value), zlib.crc32(value), deque(), at_us=now_us, stops=stops)
        last = self._orders[-1] if self._orders else None
        if last is not None and not stops and _is_copy(last, order.mark, now_us):
            if last.answer:
                self._answers.append((last.priority, last.answer))
            return
        try:
            order.steps = deque(self._steps(value))
        except SeedJsonError as error:
            self._end(order, Result.DENIED.value, str(error), now_us)
            return
        if stops:
            self._overrule(now_us)
        self._orders = [*self._orders[1 - _MAX_WAITING :], order]
        self._ask_next(order)

    def _overrule(self, now_us: int) -> None:
        """What was ordered before a stop must not be carried out after it."""
        for order in self._orders:
            if not order.result:
                self.asked = [request for request in self.asked if request.id != order.waiting]
                order.waiting = 0
                self._end(order, OVERRULED.result.value, OVERRULED.reason, now_us)

    def _steps(self, value: bytes) -> list[RequestBody]:
        fields = read_json(value)
        if isinstance(fields, dict) and "command" in fields:
            return _command(fields)
        plans = parse(value)
        load = load_plan(PlanKind.MISSION, items_from_maneuvers([plan.loiter for plan in plans]))
        if isinstance(load, PlanError):
            raise SeedJsonError(load.reason)
        self._name_items(load, [plan.name for plan in plans])
        armed = self._snapshot is not None and self._snapshot.armed
        return [load, *([] if armed else [Arm(True)]), StartPlan()]

    def _name_items(self, load: LoadPlan, names: list[str]) -> None:
        """Remember which item is which manoeuvre of the sender."""
        left = deque(names)
        self._names = {-1: str(plan_id(load.items))}
        for seq, item in enumerate(load.items):
            if (item.x or item.y) and left:
                self._names[seq] = left.popleft()

    def _ask_next(self, order: _Order) -> None:
        order.waiting = self._next_id
        self._next_id += 1
        self.asked.append(Request(order.waiting, order.steps.popleft(), sender=0))

    def _end(self, order: _Order, result: str, reason: str, now_us: int) -> None:
        order.result = result
        self._tell(order.name, result, reason, now_us)
        order.answer = self._answer(order, result, reason)
        order.steps.clear()
        order.at_us = now_us
        taken = result == Result.ACCEPTED.value or order.stops
        if order.answer and (taken or self._may_refuse(now_us)):
            self._answers.append((order.priority, order.answer))

    def _may_refuse(self, now_us: int) -> bool:
        """Whether a refusal more may go on the air: a few at once, then one a minute."""
        if now_us < self._refused_until_us - (_REFUSALS - 1) * _REFUSAL_US:
            return False
        self._refused_until_us = max(now_us, self._refused_until_us) + _REFUSAL_US
        return True

    def _note_other_boat(self, now_us: int) -> None:
        if self._other_boat_us is None or now_us - self._other_boat_us >= _OTHER_BOAT_GAP_US:
            self._other_boat_us = now_us
            self._say(Severity.WARNING, _OTHER_BOAT)

    def _tell(self, name: str, result: str, reason: str, now_us: int) -> None:
        if result == Result.ACCEPTED.value:
            self._present_us = now_us
            self._say(Severity.INFO, f"Radio: {name} accepted")
        elif self._refused_us is None or now_us - self._refused_us >= _REFUSED_GAP_US:
            self._refused_us = now_us
            self._say(Severity.WARNING, f"Radio: {name} {result}: {reason}")

    def _answer(self, order: _Order, result: str, reason: str) -> bytes:
        """The line that the sender gets; without the reason, or none, when no hour has room for it: all others would wait behind it."""
        answer = {_ACK: order.name, "crc": f"{order.mark:08x}", "result": result}
        for words in (reason[:120], ""):
            line = json.dumps(answer | ({"reason": words} if words else {}), separators=(",", ":")).encode() + b"\n"
            if self.ledger.could_ever(self._clock.airtime_us(len(line)), order.priority):
                return line
        return b""

    # ---- states -------------------------------------------------------------------------------------------------

    def _state_due(self, now_us: int) -> bytes:
        if self._snapshot is None:
            return b""
        line = state_json(self._snapshot, self.name, self._maneuver(self._snapshot))
        if self._last_state_us is None or now_us - self._last_state_us >= self.state_interval_us(len(line)):
            return line
        return b""

    def _maneuver(self, snapshot: Snapshot) -> str | None:
        if snapshot.mode is not Mode.AUTO:
            return None
        seq = snapshot.progress.seq
        ours = self._names.get(-1) == str(snapshot.progress.mission_id)
        return self._names.get(seq) if ours and seq in self._names else f"item-{seq + 1}"

    def _is_listening(self, now_us: int) -> bool:
        """Let the other side finish what it sends: pieces of a plan come with pauses of a packet's length."""
        if self._heard_us is None:
            return False
        silent_us = now_us - self._heard_us
        return silent_us < (_PAUSE_US if self._answers else 3 * _LISTEN_US)

    def _spend(self, size: int, priority: Priority, now_us: int) -> bool:
        cost_us = self._clock.airtime_us(size)
        if not self.ledger.allows(cost_us, priority, now_us):
            return False
        self._clock.sent(size, now_us)
        self.ledger.charge(cost_us, self._clock.off_us)
        return True


def _name_in(value: bytes) -> str:
    try:
        fields = json.loads(value)
    except (ValueError, RecursionError):
        return "?"
    first = fields[0] if isinstance(fields, list) and fields else fields
    found = [first[key] for key in ("id", "ID", "command") if isinstance(first, dict) and key in first]
    return str(found[0])[:64] if found else "?"


def _is_a_boats_word(value: bytes) -> bool:
    """Whether it is what a boat says, an answer or a state."""
    try:
        fields = json.loads(value)
    except (ValueError, RecursionError):
        return False
    return isinstance(fields, dict) and (_ACK in fields or fields.keys() >= _OF_A_STATE)


def _is_copy(last: _Order, mark: int, now_us: int) -> bool:
    """Whether the same text again is a repetition by its sender, not an order to do it once more."""
    taken = last.result in ("", Result.ACCEPTED.value)
    return last.mark == mark and taken and now_us - last.at_us < _AGAIN_US


def _stops(value: bytes) -> bool:
    """Whether it is a command that makes the vessel stop."""
    try:
        fields = read_json(value)
        return isinstance(fields, dict) and "command" in fields and _command(fields)[0].nature.stops
    except SeedJsonError:
        return False


def _command(fields: dict[str, Any]) -> list[RequestBody]:
    """Our own addition: ``{"command": "hold"}``, ``"resume"`` and ``"disarm"``."""
    orders: dict[str, RequestBody] = {"hold": SetMode(Mode.HOLD), "resume": SetMode(Mode.AUTO), "disarm": Arm(False)}
    body = orders.get(str(fields["command"]))
    if body is None or len(fields) != 1:
        raise SeedJsonError(f"command must be one of {', '.join(orders)}, and stand alone")
    return [body]
