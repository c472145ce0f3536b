"""Garbage on every link while a loiter is sailed: counted, and without effect."""

from __future__ import annotations

import random

import config
from companion.settings.schema import load
from mavlink_bridge.language.requests import Arm, LoadPlan, PlanItem, PlanKind, StartPlan
from mavlink_bridge.mavlink.missions.plan_mapping import load_plan
from sitl.world.settings import SimSettings
from sitl.world.world import World
from tests.plans import LAT_DEG, LON_DEG


def sailing_world(seed: int) -> World:
    world = World(load(config.path("sim.toml"), ["operator.gcs_required=false"], SimSettings), seed)
    x, y = round(LAT_DEG * 1e7), round(LON_DEG * 1e7)
    plan = load_plan(PlanKind.MISSION, [PlanItem(17, 3, 0.0, 0.0, 20.0, 0.0, x, y, 0.0)])
    assert isinstance(plan, LoadPlan)
    world.run(3.0)
    for request in (plan, Arm(arm=True), StartPlan(0)):
        world.app.submit(request)
        world.run(0.2)
    world.run(40.0)
    return world


def test_garbage_on_every_link_is_counted_and_has_no_effect() -> None:
    world = sailing_world(5)
    rng = random.Random(5)
    before = {port.link.name: port.health(world.now_us).bad_frames for port in world.app.ports}
    ends = {link.name: link for link in world.surroundings.links}
    ends |= {name: world.ground(name) for name in ("gcs", "sdk", "tcp")}
    for tick in range(1200):
        for name, link in ends.items():
            rate = 20 if name == "world-actuators" else 2
            if tick % rate == 0:
                noise = rng.choice((b"$GP", b"\xfd\x09", b"#", b"")) + rng.randbytes(rng.randrange(1, 60))
                link.write(0, noise + b"\r\n")
        world.step()
        if tick % 20 == 0:
            for name in ("gcs", "sdk", "tcp"):
                world.ground(name).poll(world.now_us)
    assert world.snapshot is not None
    assert world.snapshot.armed
    assert not [cause for cause in world.snapshot.causes if cause not in ("actuator_noise",)], (
        "a warning of a noisy line is all"
    )
    summary = world.metrics.summary()[0]
    assert summary["truth"]["rms_m"] < 0.3
    for port in world.app.ports:
        if port.link.name != "radio":
            assert port.health(world.now_us).bad_frames > before[port.link.name], port.link.name
