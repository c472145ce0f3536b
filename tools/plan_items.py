"""Makes the plan items that benches, fuzzers and pictures sail, so that each says which value is what."""

from __future__ import annotations

from mavlink_bridge.language.requests import PlanItem

NO_POSITION_E7 = (0, 0)


def plan_item(
    command: int,
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    *,
    at_e7: tuple[int, int] = NO_POSITION_E7,
    frame: int = 3,
    z: float = 0.0,
    autocontinue: int = 1,
) -> PlanItem:
    """A mission item: MAV_CMD, its ``param1`` to ``param4``, degrees * 1e7, MAV_FRAME (3: MAV_FRAME_GLOBAL_RELATIVE_ALT)."""
    first, second, third, fourth = params
    return PlanItem(
        command=command,
        frame=frame,
        param1=first,
        param2=second,
        param3=third,
        param4=fourth,
        x=at_e7[0],
        y=at_e7[1],
        z=z,
        autocontinue=autocontinue,
    )
