"""Telemetry is packed without a message object; the library's own packing of the same fields is the oracle."""

from __future__ import annotations

import dataclasses
import math
import random

import pytest
from hypothesis import given, settings, strategies as st

from mavlink_bridge.language.messages import (
    Action,
    ActuatorOutput,
    ActuatorStatus,
    Desired,
    Distance,
    EstimatedState,
    FixType,
    GpsFix,
    GuardState,
    Mode,
    PathControlState,
    PlanState,
    SupplyVoltage,
)
from mavlink_bridge.language.snapshot import ControlTrace, FenceStatus, Health, LinkHealth, Progress, Snapshot
from mavlink_bridge.mavlink.persona.config import EndpointConfig
from mavlink_bridge.mavlink.telemetry import motion as telemetry_motion, system as telemetry_system
from mavlink_bridge.mavlink.telemetry.streams import STREAMED
from mavlink_bridge.mavlink.wire.codec import dialect
from mavlink_bridge.mavlink.wire.payload import Teller, told_as

PERSONAL = {"heartbeat", "mission_current", "current_mode", "high_latency2"}
TELLERS = {
    name: teller
    for module in (telemetry_motion, telemetry_system)
    for name, teller in vars(module).items()
    if isinstance(teller, Teller)
}

ODD = (None, 0.0, -0.0, math.nan, math.inf, -math.inf)


class Chance:
    """Makes pictures of the vessel, possible ones and impossible ones."""

    def __init__(self, seed):
        self.rng = random.Random(seed)

    def of(self, *choices):
        return self.rng.choice(choices)

    def number(self):
        """Anything that a device might give."""
        return self.of(None, self.of(*ODD), self.rng.uniform(-4.0, 4.0), self.rng.uniform(-1e5, 1e5))

    def finite(self):
        """A number of those that the core itself computes."""
        return self.rng.uniform(-4.0, 4.0)

    def maybe(self, make, *args, **kwargs):
        return self.of(None, make(*args, **kwargs))

    def numbers(self, count):
        return [self.number() for _ in range(count)]

    def below(self, limit):
        return self.rng.randrange(limit)

    def flag(self):
        return self.of(False, True)

    def state(self):
        names = [field.name for field in dataclasses.fields(EstimatedState) if field.type == "float | None"]
        return EstimatedState(self.below(1 << 50), **{name: self.maybe(self.finite) for name in names})

    def fix(self):
        utc_us, satellites = self.of(None, self.below(1 << 50)), self.of(None, self.below(300))
        kind = self.of(*FixType)
        return GpsFix(self.below(1 << 50), kind, *self.numbers(4), utc_us, satellites, *self.numbers(6))

    def path(self):
        path = PathControlState(*self.numbers(5))
        eight = self.of(None, (self.finite(), abs(self.finite()), self.finite()))
        radius_m, lat_rad, lon_rad = (self.maybe(self.finite) for _ in range(3))
        return dataclasses.replace(
            path, eight=eight, orbit_radius_m=radius_m, orbit_lat_rad=lat_rad, orbit_lon_rad=lon_rad
        )

    def health(self):
        depth, battery = self.of(None, False, True), self.of(None, False, True)
        return Health(*(self.flag() for _ in range(3)), depth, self.flag(), battery, *(self.flag() for _ in range(4)))

    def snapshot(self):
        pulses_us = tuple(800 + self.below(1400) for _ in range(4))
        return Snapshot(
            self.below(1 << 50),
            0,
            self.state(),
            self.of(*Mode),
            self.flag(),
            ActuatorOutput(0, self.of(0.0, 0.5), 0.0, 0.0, 0.0, "test"),
            desired=self.maybe(Desired, self.maybe(self.finite), self.number()),
            path=self.path(),
            trace=ControlTrace(speed_error_mps=self.maybe(self.finite)),
            progress=Progress(self.of(*PlanState), *(self.below(60_000) for _ in range(3))),
            fix=self.maybe(self.fix),
            distance=self.maybe(Distance, self.below(1 << 50), self.number(), signal_quality=self.number()),
            guard=self.of(*GuardState),
            action=self.of(*Action),
            health=self.health(),
            fence=FenceStatus(self.flag(), self.below(70_000), self.below(4), self.below(1 << 50)),
            supply=self.maybe(SupplyVoltage, 0, *self.numbers(3)),
            actuator=ActuatorStatus(self.below(1 << 50), self.flag(), applied_us=self.of(None, pulses_us)),
            home_lat_rad=self.maybe(self.finite),
            home_lon_rad=self.maybe(self.finite),
            utc_us=self.of(None, self.below(1 << 50)),
            links=tuple(LinkHealth("gcs", "endpoint", True, bad_frames=self.below(50_000)) for _ in range(2)),
            throttle=self.finite(),
            load=self.finite(),
        )

    def face(self):
        return EndpointConfig(persona=self.of("ardurover", "generic"), generic_mode_encoding=self.of("px4", "rover"))


def by_the_library(teller, values):
    """Payload of the message object with these fields, as pymavlink itself packs it."""
    message_class = dialect.mavlink_map[teller.message_id]
    lengths = dict(zip(message_class.ordered_fieldnames, message_class.lengths, strict=True))
    rest = iter(values)
    fields = {}
    for name in teller.fields:
        taken = [next(rest) for _ in range(lengths[name])]
        fields[name] = taken[0] if lengths[name] == 1 else taken
    assert next(rest, None) is None, "as many values as the fields hold"
    message = message_class(**fields)
    if message_class.__init__.__module__.startswith("pymavlink"):
        message.pack(dialect.MAVLink(None, srcSystem=1, srcComponent=1))
        return message.get_payload()
    ordered = []
    for name in message_class.ordered_fieldnames:
        value = getattr(message, name)
        ordered += value if isinstance(value, list) else [value]
    return message_class.unpacker.pack(*ordered).rstrip(b"\0")


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 1 << 32))
def test_a_payload_is_the_librarys(seed):
    chance = Chance(seed)
    for name, teller in TELLERS.items():
        shown = (chance.snapshot(), chance.face()) if name in PERSONAL else (chance.snapshot(),)
        if name == "mission_item_reached":
            shown = chance.below(65_000), chance.face()
        values, packed = teller.values(*shown), teller(*shown)
        if values is None:
            assert packed is None
        else:
            assert packed == (teller.message_id, by_the_library(teller, values) or b"\0"), name


def test_every_stream_has_one():
    reached = dialect.MAVLINK_MSG_ID_MISSION_ITEM_REACHED
    assert {teller.message_id for teller in TELLERS.values()} == STREAMED | {reached}


def test_fields_stand_in_the_order_of_the_wire():
    with pytest.raises(ValueError, match="the wire has time_boot_ms roll pitch"):
        told_as("ATTITUDE", "roll pitch yaw time_boot_ms")(lambda: (0.0,))
