"""Plan files of every known format, told apart by their contents: QGroundControl's .plan and .mission, "QGC WPL", the old fence
list, and the seed's JSON.

Texts in, ``PlanFile`` out; nothing is opened here. What is no plan file, or has parts that cannot be expanded, raises
``PlanFileError`` with every problem found. Whether the vessel can sail a plan is not judged here but by ``plan_mapping``.
"""

from __future__ import annotations

from ..mavlink.missions.plan_export import items_from_maneuvers
from . import seed_json
from .form import MAX_BYTES, PlanFile, PlanFileError
from .qgc_plan import from_json, write_plan
from .wpl import read_fence_list, read_wpl, write_wpl

__all__ = ["PlanFile", "PlanFileError", "read_plan", "write_plan", "write_wpl"]


def read_plan(data: bytes | str, name: str = "") -> PlanFile:
    """Read a plan file of any known format, told by its contents. ``name`` is for the messages. Raises PlanFileError."""
    if len(data) > MAX_BYTES:
        raise PlanFileError(f"{name or 'the file'} has {len(data)} bytes, {MAX_BYTES} fit")
    try:
        text = data.decode("utf-8-sig") if isinstance(data, bytes) else data
    except UnicodeDecodeError:
        raise PlanFileError(f"{name or 'the file'} is not UTF-8 text") from None
    start = text.lstrip()
    if start.startswith("QGC WPL"):
        return read_wpl(start)
    if start.startswith(("{", "[")):
        return _read_json(text)
    return read_fence_list(text)


def _read_json(text: str) -> PlanFile:
    try:
        found = seed_json.read_json(text)
        if isinstance(found, dict) and ("fileType" in found or "mission" in found or "MAV_AUTOPILOT" in found):
            return from_json(found)
        plans = seed_json.parse(text)
    except seed_json.SeedJsonError as error:
        raise PlanFileError(str(error)) from None
    return PlanFile(items_from_maneuvers([plan.loiter for plan in plans]), format="seed JSON")
