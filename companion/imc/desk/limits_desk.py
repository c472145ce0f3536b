"""Operational limits set and told: carried out on the vehicle first, then kept, then answered as they are in force.

A message that is refused changes nothing, whichever of its limits it is refused for.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.client import HeardVehicle, Job, JobOutcome, VehicleClient
from mavlink_bridge.mavlink.client.exchange import DONE
from mavlink_bridge.mavlink.client.parameters import read
from mavlink_bridge.mavlink.client.transfers import upload

from .limits import MIN_ALTITUDE, ConsoleLimits, LimitArea, changes, in_words, limits_of, lowered, unknown_limits
from .orders import Helm
from .params_desk import ParamsDesk, Tell


class LimitsDesk:
    """``keep`` stores what was changed."""

    def __init__(
        self,
        client: VehicleClient,
        helm: Helm,
        params: ParamsDesk,
        limits: ConsoleLimits,
        *,
        answer: Tell,
        say: Callable[[int, str], None],
        keep: Callable[[], None],
    ) -> None:
        self._client = client
        self._helm = helm
        self._params = params
        self.limits = limits
        self._answer = answer
        self._say = say
        self._keep = keep

    def tell(self, asker: Asker, label: str) -> None:
        """Answer with the limits in force."""
        self._answer(self.limits.message(self._params.value(MIN_ALTITUDE)), asker, label)

    def set(self, message: imc.OperationalLimits, asker: Asker, label: str, now_us: int) -> None:
        """Take a console's limits as a whole: what its mask leaves out is limited no longer, but for the depth guard's altitude."""
        vehicle = self._client.vehicle
        unknown = unknown_limits(message.mask)
        if unknown:
            self._say(4, f"limits of {unknown} are not a surface vessel's: passed over")
        try:
            wanted = limits_of(message)
        except ValueError as error:
            self._refuse(str(error), asker, label)
            return
        if vehicle is None:
            self._refuse("the vessel is not heard", asker, label)
            return
        least_m = message.min_altitude_m if message.mask & imc.LimitsMask.MIN_ALT else None
        before: dict[str, float] = {}

        def done(outcome: JobOutcome) -> None:
            if not outcome.ok:
                self._refuse(outcome.reason, asker, label)
                return
            said = changes(self.limits, wanted) + lowered(before.get(MIN_ALTITUDE), least_m)
            self.limits = wanted
            if least_m is not None:
                self._params.heard(MIN_ALTITUDE, least_m)
            self._keep()
            self._say(4 if any(each.weakens for each in said) else 5, f"{asker}: limits: {in_words(said)}")
            self.tell(asker, label)

        self._client.start(self._carried_out(vehicle, least_m, wanted.area, before), done, now_us)

    def _refuse(self, reason: str, asker: Asker, label: str) -> None:
        self._say(4, f"{asker}: limits refused: {reason}")
        self.tell(asker, label)

    def _carried_out(
        self, vehicle: HeardVehicle, least_m: float | None, area: LimitArea | None, before: dict[str, float]
    ) -> Job:
        """The parameter first, because it can be put back; a fence is taken or refused as a whole. ``before``: what was aboard."""
        if least_m is not None:
            outcome = yield from read(vehicle, MIN_ALTITUDE, before, answer_s=self._helm.answer_s)
            if outcome.ok:
                outcome = yield from self._helm.put([(MIN_ALTITUDE, least_m)])
            if not outcome.ok:
                return outcome
        if area == self.limits.area:
            return DONE
        items = area.fence() if area is not None else ()
        outcome = yield from upload(
            vehicle, PlanKind.FENCE, items, texts=self._client.texts_heard, answer_s=self._helm.answer_s
        )
        if not outcome.ok and before:
            back = yield from self._helm.put(list(before.items()))
            if not back.ok:
                return JobOutcome(False, f"{outcome.reason}; {MIN_ALTITUDE} stays at {least_m:g} m: {back.reason}")
        return outcome
