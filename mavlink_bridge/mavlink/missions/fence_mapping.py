"""Fence and rally items to areas and points, with the item and the reason of every refusal."""

from __future__ import annotations

from collections.abc import Sequence

from ...language import messages as imc
from ...language.points import LatLon
from ...language.requests import PlanItem
from ..wire.cmd import Cmd
from .fence_shape import shape_refusal
from .plan_rules import DEFAULT_LIMITS, MissionResult, PlanError, PlanLimits, RefusedError, position


def compile_rally(
    items: Sequence[PlanItem], limits: PlanLimits = DEFAULT_LIMITS
) -> tuple[tuple[LatLon, ...], tuple[PlanError, ...]]:
    """Rally points in rad, and the errors."""
    if len(items) > limits.max_items:
        reason = f"{len(items)} rally points, {limits.max_items} fit"
        return (), (PlanError(limits.max_items, None, reason, MissionResult.NO_SPACE),)
    points: list[LatLon] = []
    errors: list[PlanError] = []
    for seq, item in enumerate(items):
        try:
            if item.command != Cmd.RALLY_POINT:
                raise RefusedError(None, f"command {item.command} is not a rally point", MissionResult.UNSUPPORTED)
            points.append(LatLon(position(item)))
        except RefusedError as refusal:
            errors.append(PlanError(seq, refusal.field, str(refusal), refusal.result))
    return tuple(points), tuple(errors)


def compile_fence(
    items: Sequence[PlanItem], limits: PlanLimits = DEFAULT_LIMITS
) -> tuple[tuple[imc.FenceArea, ...], tuple[PlanError, ...]]:
    """Fence areas, and the errors. A return point (5000) is checked and kept but not used: rally points and home are."""
    if len(items) > limits.max_items:
        reason = f"{len(items)} fence items, {limits.max_items} fit"
        return (), (PlanError(limits.max_items, None, reason, MissionResult.NO_SPACE),)
    areas: list[imc.FenceArea] = []
    at = 0
    while at < len(items):
        try:
            area, used = _fence_area(items, at, limits)
        except _FenceError as refusal:
            return tuple(areas), (PlanError(refusal.seq, refusal.field, str(refusal), refusal.result),)
        if area is not None:
            areas.append(area)
        at += used
    return tuple(areas), ()


class _FenceError(RefusedError):
    def __init__(self, seq: int, field_number: int | None, reason: str, result: MissionResult | None = None) -> None:
        super().__init__(field_number, reason, result)
        self.seq = seq


def _fence_area(items: Sequence[PlanItem], at: int, limits: PlanLimits) -> tuple[imc.FenceArea | None, int]:
    """The area that starts at item ``at`` and how many items it takes."""
    item = items[at]
    inclusion = item.command in (Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_CIRCLE_INCLUSION)
    if item.command == Cmd.FENCE_RETURN_POINT:
        _fence_position(at, item)
        return None, 1
    if item.command in (Cmd.FENCE_CIRCLE_INCLUSION, Cmd.FENCE_CIRCLE_EXCLUSION):
        radius = item.param1
        if not 0.0 < radius <= limits.max_length_m:
            raise _FenceError(at, 1, f"fence radius {radius:g} m is outside 0 to {limits.max_length_m:g}")
        return imc.FenceArea(inclusion, centre_rad=_fence_position(at, item), radius_m=radius), 1
    if item.command not in (Cmd.FENCE_POLYGON_INCLUSION, Cmd.FENCE_POLYGON_EXCLUSION):
        raise _FenceError(at, None, f"command {item.command} is not a fence item", MissionResult.UNSUPPORTED)
    count = item.param1
    if not 3 <= count <= limits.max_items or count != int(count):
        raise _FenceError(at, None, f"a polygon of {count:g} vertices: at least 3 are needed")
    vertices = items[at : at + int(count)]
    for place, vertex in enumerate(vertices, at):
        if vertex.command != item.command or vertex.param1 != count:
            raise _FenceError(place, None, f"the polygon of {count:g} vertices ends after {place - at}")
    if len(vertices) < count:
        raise _FenceError(len(items) - 1, None, f"the polygon of {count:g} vertices ends after {len(vertices)}")
    corners = tuple(LatLon(_fence_position(place, vertex)) for place, vertex in enumerate(vertices, at))
    corner, why = shape_refusal(corners, inclusion=inclusion)
    if why:
        raise _FenceError(at + corner, None, why)
    return imc.FenceArea(inclusion, vertices_rad=corners), int(count)


def _fence_position(seq: int, item: PlanItem) -> tuple[float, float]:
    try:
        return position(item)
    except RefusedError as refusal:
        raise _FenceError(seq, refusal.field, str(refusal), refusal.result) from None
