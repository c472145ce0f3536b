"""Plain MAVLink over the simulated air in virtual time: a radio with its endpoint, a vessel that obeys, and any station."""

from __future__ import annotations

import random
from typing import Any, Protocol

from companion.radio import plain_radio
from mavlink_bridge.radio.air.airtime import PHYS
from mavlink_bridge.radio.air.ledger import Ledger
from sitl.radio.air import RadioConfig, RadioPair
from tests.fake_vessel import TICK_US, FakeVessel
from tools.lora_rig import profile

STEP_US = 10_000
X, Y = 411_852_000, -87_060_000
PLAN = [
    (0, 16, 0.0, 0.0, 0.0, 0.0, X, Y, 0.0),
    (2, 178, 1.0, 1.5, -1.0, 0.0, 0, 0, 0.0),
    (3, 19, 60.0, 0.0, 20.0, 0.0, X, Y, 0.0),
]
"""Home, speed, and a loiter of 60 s on a circle of 20 m."""


class Talker(Protocol):
    """The station at the shore modem's serial port."""

    def receive(self, data: bytes, now_us: int) -> None: ...
    def take(self, now_us: int) -> bytes: ...


class PlainRig:
    """The vessel serves its radio at its ticks and when bytes come, as the loop does; ``seed`` shifts its ticks against the station.

    ``is_talkative``: the station may speak at any time, not only at the vessel's ticks.
    """

    def __init__(
        self,
        station: Talker,
        *,
        phy: str = "SF7",
        seed: int = 0,
        is_talkative: bool = True,
        ledger: Ledger | None = None,
        vessel: FakeVessel | None = None,
        **radio: Any,
    ) -> None:
        rate = PHYS[phy].bit_rate
        self.profile = profile("plain-10", phy=phy, air_rate=rate, lbt=bool(radio.get("listen_first")))
        self.pair = RadioPair(RadioConfig(phy=phy, header_bytes=0, **radio), random.Random(f"{seed}/air"))
        self.vessel = vessel or FakeVessel()
        self.vessel.now_us = self.now_us = 0
        self.radio = plain_radio(self.profile, self.vessel, random.Random(f"{seed}/radio"), ledger=ledger)
        self.station = station
        self.is_talkative = is_talkative
        self._shift_us = random.Random(seed).randrange(5) * STEP_US

    def step(self) -> None:
        """Advance to the next moment at which something can happen: 10 ms while bytes are under way, else to the next tick."""
        left_us = TICK_US - (self.now_us + self._shift_us) % TICK_US
        self.now_us += STEP_US if self.pair.is_busy or self.is_talkative else left_us
        now_us = self.vessel.now_us = self.now_us
        self.pair.step(now_us)
        heard = self.pair.vessel.read()
        if heard:
            self.radio.receive(heard, now_us)
        is_tick = (now_us + self._shift_us) % TICK_US == 0
        if is_tick:
            for request in self.radio.requests():
                reply = self.vessel.handle(request)
                if request.reply:
                    self.radio.reply(request.id, reply, now_us)
            self.radio.tick(now_us, self.vessel.snapshot())
        if heard or is_tick:
            self.pair.vessel.write(self.radio.take(now_us, 1200))
        heard = self.pair.shore.read()
        if heard:
            self.station.receive(heard, now_us)
        self.pair.shore.write(self.station.take(now_us))

    def run(self, seconds: float) -> None:
        end_us = self.now_us + round(seconds * 1e6)
        while self.now_us < end_us:
            self.step()
