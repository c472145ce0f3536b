"""A second gateway beside the first, with the same key, on one air with one vessel that only keeps books."""

from __future__ import annotations

from mavlink_bridge.radio.shore import ShoreTwin
from sitl.radio import RadioEnd
from tools.lora_rig import Rig, profile


class TwoGateways(Rig):
    """The second one is off until ``start_second``; either may be switched off."""

    def __init__(self, name: str = "o-10", *, seed: int = 0) -> None:
        super().__init__(profile(name), seed=seed)
        self.second: ShoreTwin | None = None
        self.first_is_on = True
        self.second_has_station = True
        self._second_end = RadioEnd(self.pair.air, self.pair.air.join("second", 0xBBBD))

    def start_second(self) -> ShoreTwin:
        """Switch the second one on, which knows nothing."""
        self.second = self._gateway("second")
        return self.second

    def step(self) -> None:
        super().step()
        if self.second is not None:
            self._serve(self.second, self._second_end, self.now_us, station_present=self.second_has_station)

    def _shore(self, now_us: int) -> None:
        if self.first_is_on:
            super()._shore(now_us)

    @property
    def station_age_s(self) -> float:
        """How long ago a station that counts was last there, as the vessel knows."""
        heard_us = self.radio.last_heartbeat_us
        assert heard_us is not None
        return (self.now_us - heard_us) * 1e-6


def met(name: str = "o-10", *, seed: int = 0) -> TwoGateways:
    """All three have found each other; nobody has ordered anything."""
    rig = TwoGateways(name, seed=seed)
    rig.settle()
    second = rig.start_second()
    while second.state is None:
        rig.step()
    rig.run(5.0)
    return rig
