"""Plans that several tests sail."""

from __future__ import annotations

from typing import Any

LAT_DEG, LON_DEG = 41.1852, -8.7060
"""Some 27 m from the simulator's default start, in deep water."""


def simple_item(number: int, command: int, frame: int, params: list[float | None]) -> dict[str, Any]:
    """One SimpleItem of a QGroundControl plan."""
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": frame,
        "autoContinue": True,
        "doJumpId": number,
        "params": params,
    }


def qgc_plan(items: list[dict[str, Any]]) -> dict[str, Any]:
    """A QGroundControl .plan file around items."""
    return {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": 3,
            "vehicleType": 11,
            "cruiseSpeed": 1.5,
            "hoverSpeed": 1.5,
            "globalPlanAltitudeMode": 1,
            "plannedHomePosition": [LAT_DEG, LON_DEG, 0],
            "items": items,
        },
        "geoFence": {"version": 2, "polygons": [], "circles": []},
        "rallyPoints": {"version": 2, "points": []},
    }


LOITER_PLAN = qgc_plan(
    [
        simple_item(1, 178, 2, [1, 1.5, -1, 0, 0, 0, 0]),
        simple_item(2, 19, 3, [100, 0, 20, 1, LAT_DEG, LON_DEG, 50]),
    ]
)
"""1.5 m/s, then 100 s around a circle of 20 m."""

SEED_LOITER = {
    "ID": "loiter-1",
    "Latitude": LAT_DEG,
    "Longitude": LON_DEG,
    "Duration": 60,
    "Loiter type": "Circular",
    "Speed": 3.0,
    "Length": 0,
    "Radius": 20,
}
"""A plan as the seed's Lora_serial task took it."""
