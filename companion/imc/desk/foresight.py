"""What the vessel will refuse a saved plan for, as far as it can be known ashore: a speed beyond its hull, and a plan of another place.

Nothing is refused by it. The vessel judges when the plan comes aboard, and by then lies where it lies; its words are used.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_bridge.language.messages import EstimatedState
from mavlink_bridge.language.points import LatLon
from mavlink_bridge.mavlink.missions.plan_mapping import compile_items
from mavlink_bridge.mavlink.missions.plan_rules import plan_id
from mavlink_bridge.mavlink.telemetry.numbering import named_text

from ...core.vehicle.plan_reach import FAR_OK, MissionConfig, PlanReach, plan_number, speed_refusal
from .plan import Plan


class Foresight:
    """``top_mps``: the hull's greatest speed, None when it is not known. ``here`` and ``home``: where they are, as far as that is heard."""

    def __init__(
        self,
        top_mps: float | None,
        mission: MissionConfig,
        here: Callable[[], LatLon | None],
        home: Callable[[], LatLon | None],
    ) -> None:
        self._top_mps = top_mps
        self._mission = mission
        self._here = here
        self._home = home

    def of(self, plan: Plan, told: Callable[[str], float | None]) -> str:
        """Why START would be refused, or "". ``told``: a parameter as the vessel last told it."""
        sailed, here = compile_items(plan.items).plan, self._here()
        refusal = "" if self._top_mps is None else speed_refusal(sailed.maneuvers, self._top_mps)
        if not refusal and here is not None:
            reach = PlanReach(self._limits(told))
            reach.number = plan_number(plan_id(plan.items))
            state = EstimatedState(0, lat_rad=here[0], lon_rad=here[1])
            refusal = reach.refusal(sailed, 0, state, self._home())
        return named_text(refusal, lambda number: plan.stage_of(number).name)

    def _limits(self, told: Callable[[str], float | None]) -> MissionConfig:
        first_m, leg_m, far_plan = told("MIS_DIST_1WP"), told("MIS_DIST_WPS"), told(FAR_OK)
        known = {"first_distance_m": first_m, "leg_distance_m": leg_m, "far_plan": far_plan and int(far_plan)}
        return self._mission.model_copy(update={key: value for key, value in known.items() if value is not None})
