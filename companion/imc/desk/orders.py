"""What an order of a console is for the vehicle: the jobs of the MAVLink client, one after the other.

START: halt, load, set what the plan sets, arm if it must, sail. A start that fails after arming disarms again, so that a
refusal leaves nothing turning. Teleoperation arms in manual mode, where the vessel asks for no position.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from mavlink_bridge.language.messages import Mode
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.client import (
    Autopilot,
    HeardVehicle,
    Job,
    JobOutcome,
    VehicleClient,
    orders,
    parameters,
    transfers,
)
from mavlink_bridge.mavlink.client.exchange import DONE, Step
from mavlink_bridge.mavlink.client.texts import Texts
from mavlink_bridge.mavlink.missions.plan_rules import plan_id

from .plan import Plan

_LOOK_S: Final = 0.05
"""One tick."""
Values = Sequence[tuple[str, float]]
"""Parameters to set."""


class Helm:
    """Makes the jobs for the vehicle that the client has found."""

    def __init__(self, client: VehicleClient, *, answer_s: float, may_arm: bool) -> None:
        self._client = client
        self.answer_s = answer_s
        self._may_arm = may_arm
        self.is_loading = False
        """A plan is on its way to a vessel that is not armed: nobody needs a sign of life, and a radio has the air for the plan."""

    @property
    def vehicle(self) -> HeardVehicle | None:
        return self._client.vehicle

    def start(self, plan: Plan, values: Values, begun: Callable[[], None]) -> Job:
        """Sail a plan from its beginning; ``begun`` is called just before the vehicle is told to sail."""
        vehicle = self._there()
        if vehicle.mode is Mode.AUTO:
            outcome = yield from self.hold()
            if not outcome.ok:
                return outcome
        self.is_loading = not vehicle.armed
        try:
            outcome = yield from self.load(plan)
        finally:
            self.is_loading = False
        if outcome.ok:
            outcome = yield from self.put(values)
        if not outcome.ok:
            return outcome
        if self._there().armed:
            begun()
            return (yield from self._sail())
        return (yield from self._arm_and_sail(begun))

    def _sail(self) -> Job:
        return orders.start_mission(self._there(), texts=self._texts, answer_s=self.answer_s)

    def _arm_and_sail(self, begun: Callable[[], None]) -> Job:
        """Both orders go out together: behind a radio each round trip is a second. A start that comes before the arming is said again."""
        self._client.present()
        started: list[JobOutcome] = []
        sail = self._sail()
        if self._may_arm:
            begun()
            self._client.start(sail, started.append, self._client.now_us)
        try:
            outcome = yield from self._arm()
            while outcome.ok and not started:
                yield Step(lambda _: (), lambda _: False, _LOOK_S)
        finally:
            self._client.give_up("overruled", sail)
        if not outcome.ok:
            return outcome
        outcome = started[0]
        if not outcome.ok and "not armed" in outcome.reason.lower():
            outcome = yield from self._sail()
        if not outcome.ok:
            yield from self.disarm(force=False)
        return outcome

    def load(self, plan: Plan) -> Job:
        """Bring a plan aboard, unless it is there."""
        vehicle, number = self._there(), plan_id(plan.items)
        if vehicle.mission_id and vehicle.mission_id == number:
            return DONE
        outcome = yield from transfers.upload(
            vehicle, PlanKind.MISSION, plan.items, texts=self._texts, answer_s=self.answer_s
        )
        if outcome.ok and vehicle.kind is not Autopilot.OURS:
            yield from orders.to_first_item(vehicle, texts=self._texts, answer_s=self.answer_s)
        return outcome

    def steer_by_hand(self) -> Job:
        """Manual mode, armed."""
        self._client.present()
        outcome = yield from orders.set_mode(self._there(), Mode.MANUAL, texts=self._texts, answer_s=self.answer_s)
        if not outcome.ok:
            return outcome
        outcome = yield from self._arm()
        if not outcome.ok:
            yield from self.hold()
        return outcome

    def hold(self) -> Job:
        """Keep station where it is."""
        return orders.set_mode(self._there(), Mode.HOLD, texts=self._texts, answer_s=self.answer_s)

    def disarm(self, *, force: bool) -> Job:
        return orders.disarm(self._there(), force=force, texts=self._texts, answer_s=self.answer_s)

    def put(self, values: Values) -> Job:
        """Set parameters, one after the other."""
        for name, value in values:
            outcome = yield from parameters.put(self._there(), name, value, texts=self._texts, answer_s=self.answer_s)
            if not outcome.ok:
                return outcome
        return DONE

    def _arm(self) -> Job:
        if self._there().armed:
            return DONE
        if not self._may_arm:
            return JobOutcome(False, "the vessel is not armed, and orders by IMC may not arm it (may_arm)")
        return (yield from orders.arm(self._there(), texts=self._texts, answer_s=self.answer_s))

    @property
    def _texts(self) -> Texts:
        return self._client.texts_heard

    def _there(self) -> HeardVehicle:
        vehicle = self._client.vehicle
        assert vehicle is not None, "orders are made for a vehicle that was heard"
        return vehicle
