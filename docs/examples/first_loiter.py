"""Sail a loiter in the simulator from Python: the whole public API in thirty lines.

.venv/bin/python docs/examples/first_loiter.py
"""

from __future__ import annotations

import math

import config
from companion.settings import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world import SimSettings, World

CHANGE_SPEED, LOITER_TIME = 178, 19
RADIUS_M = 20.0


def main(duration_s: float = 150.0, seed: int = 1) -> float:
    """Sail for a while; return the RMS radius error against truth, in metres."""
    world = World(load(config.path("sim.toml"), ["operator.gcs_required=false"], SimSettings), seed)
    centre_n, centre_e = 40.0, 15.0
    lat_rad, lon_rad = world.surroundings.plant.frame.to_geodetic(centre_n, centre_e)
    x, y = round(math.degrees(lat_rad) * 1e7), round(math.degrees(lon_rad) * 1e7)
    plan = load_plan(
        PlanKind.MISSION,
        [
            PlanItem(CHANGE_SPEED, 2, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
            PlanItem(LOITER_TIME, 3, 600.0, 0.0, RADIUS_M, 1.0, x, y, 0.0),
        ],
    )
    assert isinstance(plan, LoadPlan), plan
    world.run(2.0)  # until the compass and the board have answered
    for request in (plan, Arm(arm=True), StartPlan(0)):
        world.app.submit(request, lambda reply: print(reply.result.value, reply.reason))
        world.run(0.2)
    errors = []
    while world.now_us < duration_s * 1e6:
        truth = world.step()
        if world.snapshot is not None and world.snapshot.path.on_path:
            errors.append(math.dist((truth.north_m, truth.east_m), (centre_n, centre_e)) - RADIUS_M)
    rms_m = math.sqrt(sum(error * error for error in errors) / len(errors))
    print(f"{len(errors) / 20:.0f} s on the circle, radius error {rms_m:.3f} m RMS")
    return rms_m


if __name__ == "__main__":
    main()
