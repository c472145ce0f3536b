"""Operational limits set and told: carried out on the vehicle first, then kept, then answered as they are in force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mavlink_bridge import imc
from mavlink_bridge.imc.system import Asker
from mavlink_bridge.language.requests import PlanKind
from mavlink_bridge.mavlink.client import HeardVehicle, Job, JobOutcome, VehicleClient
from mavlink_bridge.mavlink.client.exchange import DONE
from mavlink_bridge.mavlink.client.transfers import upload

from .limits import MIN_ALTITUDE, ConsoleLimits, area_of, unknown_limits
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
            area = area_of(message)
        except ValueError as error:
            self._say(4, f"limits refused: {error}")
            self.tell(asker, label)
            return
        if vehicle is None:
            self._say(4, "limits refused: the vessel is not heard")
            self.tell(asker, label)
            return
        has_speed = bool(message.mask & imc.LimitsMask.MAX_SPEED) and message.max_speed_mps > 0.0
        wanted = ConsoleLimits(message.max_speed_mps if has_speed else None, area)

        def done(outcome: JobOutcome) -> None:
            if outcome.ok:
                self.limits = wanted
                if message.mask & imc.LimitsMask.MIN_ALT:
                    self._params.heard(MIN_ALTITUDE, message.min_altitude_m)
                self._keep()
            else:
                self._say(4, f"limits refused: {outcome.reason}")
            self.tell(asker, label)

        self._client.start(self._carried_out(vehicle, message, wanted), done, now_us)

    def _carried_out(self, vehicle: HeardVehicle, message: imc.OperationalLimits, wanted: ConsoleLimits) -> Job:
        if wanted.area != self.limits.area:
            items = wanted.area.fence() if wanted.area is not None else ()
            outcome = yield from upload(
                vehicle, PlanKind.FENCE, items, texts=self._client.texts_heard, answer_s=self._helm.answer_s
            )
            if not outcome.ok:
                return outcome
            self.limits = replace(self.limits, area=wanted.area)
        if message.mask & imc.LimitsMask.MIN_ALT:
            return (yield from self._helm.put([(MIN_ALTITUDE, message.min_altitude_m)]))
        return DONE
