"""LoRa modules, two or more, and the air between them, in virtual time: what a radio link does to bytes, and what it costs.

Half duplex (who transmits hears nothing), no coordination, loss by packet or in bursts (Gilbert), delays, pieces merged and split,
and an account of every transmission, by which tools and tests hold a protocol to its airtime. Time on air: Semtech's formula.
"""

from __future__ import annotations

import random
from collections import deque
from dataclasses import dataclass
from typing import Final

from pydantic import Field, field_validator

from companion.core.config import Config
from mavlink_bridge.radio.air.airtime import PHYS, packet_us
from mavlink_bridge.radio.air.module import ModuleError

from .module import FACTORY_BLOCK, RadioModule, set_up

_KEPT: Final = 500_000
"""Packets of a rig that is measured; a simulation for an operator keeps what ``RadioPair`` is told."""
_HOUR_US: Final = 3_600_000_000


class RadioConfig(Config):
    """The simulated radio: its modulation, the channel's faults and the modules' habits."""

    phy: str = ""
    """Name in mavlink_bridge.radio.air.airtime.PHYS (A is 651 bit/s); empty = what the vessel's radio profile says."""
    header_bytes: int | None = Field(None, ge=0, le=32)
    """What the module adds to each packet, unknown for the real one; None = what the profile says."""
    loss: float = Field(0.0, ge=0.0, le=1.0)
    """Share of packets lost."""
    burst_s: float = Field(0.0, ge=0.0, le=600.0)
    """Mean length of a fade; 0 = every packet is lost or not by itself."""
    corrupt: float = Field(0.0, ge=0.0, le=1.0)
    """Share of the packets that arrive with flipped bits."""
    delay_ms: float = Field(20.0, ge=0.0, le=2000.0)
    """From the end of a packet on the air to its first byte on the serial line."""
    gap_ms: float = Field(5.0, ge=0.0, le=200.0)
    """Idle time on the serial line after which the module sends what it has."""
    buffer_bytes: int = Field(512, ge=64, le=65536)
    """What the module keeps of bytes that it cannot send yet; what comes beyond is lost."""
    split: bool = False
    """Reads return random pieces."""
    listen_first: bool = False
    """The module waits while it hears the other one (its LBT box)."""
    model: str = "LORA6500PRO_VER3.1_E"
    """What the module calls itself when its settings are read."""

    vessel_module: str = ""
    """Settings of the vessel's module, as `companion lora set` takes them: `net_id=22222222 parity=even`; `key` in hexadecimal digits."""
    shore_module: str = ""
    """The same of the shore's."""

    @field_validator("vessel_module", "shore_module")
    @classmethod
    def _settable(cls, value: str) -> str:
        try:
            set_up(FACTORY_BLOCK, value)
        except ModuleError as error:
            raise ValueError(str(error).removesuffix("; nothing was written")) from None
        return value

    @field_validator("phy")
    @classmethod
    def _known(cls, value: str) -> str:
        if value and value not in PHYS:
            raise ValueError(f"choose one of {', '.join(PHYS)}")
        return value

    def with_profile(self, phy: str, header_bytes: int) -> RadioConfig:
        """The same with what is left open taken from a radio profile."""
        header = header_bytes if self.header_bytes is None else self.header_bytes
        return self.model_copy(update={"phy": self.phy or phy, "header_bytes": header})


@dataclass(frozen=True, slots=True)
class Transmission:
    """One packet on the air."""

    start_us: int
    end_us: int
    data: bytes
    origin: str
    fate: str
    """'received', or why not: 'collision', 'faded', 'unheard'."""


@dataclass(slots=True)
class _Flight:
    sender: RadioModule
    receivers: tuple[RadioModule, ...]
    data: bytes
    start_us: int
    end_us: int
    collided: bool = False


class Air:
    """The channel. Events are worked off in the order of their times."""

    def __init__(self, config: RadioConfig, rng: random.Random, kept: int = _KEPT) -> None:
        self.config = config
        self.now_us = 0
        self.log: deque[Transmission] = deque(maxlen=kept)
        """The newest packets, oldest first."""
        self.jammed = False
        """Tests set it: everything on the air is lost."""
        self._rng = rng
        self._flights: list[_Flight] = []
        self._fading = False
        self._fade_change_us: int | None = None
        self.modules: tuple[RadioModule, ...] = (self._module("vessel", 0xBBBB), self._module("shore", 0xBBBC))

    def join(self, name: str, node: int) -> RadioModule:
        """One more module, set as the shore's is: everybody hears everybody."""
        module = self._module(name, node)
        self.modules = (*self.modules, module)
        return module

    def configure(self, config: RadioConfig) -> None:
        """Change the channel from now on; what is on the air keeps its airtime."""
        self.config = config
        self._fade_change_us = None

    def _module(self, name: str, node: int) -> RadioModule:
        config = self.config
        module = RadioModule(
            name,
            self._rng,
            gap_us=round(config.gap_ms * 1e3),
            buffer_bytes=config.buffer_bytes,
            split=config.split,
            model=config.model,
        )
        block = module.block[:12] + node.to_bytes(2, "big") + module.block[14:]
        module.block = set_up(block, config.vessel_module if name == "vessel" else config.shore_module)
        return module

    def step(self, now_us: int) -> None:
        """Let everything happen up to ``now_us``. Earlier times are ignored."""
        while self._flights or any(module.for_air for module in self.modules):
            event = self._next_event()
            if event is None or event[0] > now_us:
                break
            at_us, flight, module = event
            if flight is not None:
                self._land(flight)
            elif module is not None:
                self._launch(module, at_us)
        if now_us > self.now_us:
            self.now_us = now_us

    def _next_event(self) -> tuple[int, _Flight | None, RadioModule | None] | None:
        """Landings go before launches of the same moment."""
        events: list[tuple[int, int, _Flight | None, RadioModule | None]] = []
        events += [(flight.end_us, 0, flight, None) for flight in self._flights]
        for module in self.modules:
            start_us = self._start_us(module)
            if start_us is not None:
                events.append((start_us, 1, None, module))
        if not events:
            return None
        at_us, _, flight, starter = min(events, key=lambda item: item[:2])
        return at_us, flight, starter

    def _start_us(self, module: RadioModule) -> int | None:
        start_us = module.next_start_us()
        if start_us is None or not self.config.listen_first:
            return start_us
        return max([start_us, *(flight.end_us for flight in self._flights if module in flight.receivers)])

    def _launch(self, module: RadioModule, start_us: int) -> None:
        others = tuple(other for other in self.modules if other is not module)
        data = module.take_packet(start_us)
        end_us = start_us + packet_us(len(data), PHYS[self.config.phy or "A"], self.config.header_bytes or 0)
        module.busy_until_us = end_us
        new = _Flight(module, others, data, start_us, end_us)
        for flight in self._flights:
            flight.collided = new.collided = True
        self._flights.append(new)

    def _land(self, flight: _Flight) -> None:
        self._flights.remove(flight)
        fate = self._fate(flight)
        self.log.append(Transmission(flight.start_us, flight.end_us, flight.data, flight.sender.name, fate))
        if fate == "received":
            data = self._garble(flight.data)
            for receiver in flight.receivers:
                if receiver.hears(flight.sender):
                    receiver.to_host(data, flight.end_us + round(self.config.delay_ms * 1e3))

    def _fate(self, flight: _Flight) -> str:
        faded = self._faded(flight.end_us)
        if flight.collided:
            return "collision"
        if faded or self.jammed:
            return "faded"
        heard = any(receiver.hears(flight.sender) for receiver in flight.receivers)
        return "received" if heard else "unheard"

    def _faded(self, at_us: int) -> bool:
        loss, burst_us = self.config.loss, self.config.burst_s * 1e6
        if loss in (0.0, 1.0):
            return loss == 1.0
        if burst_us == 0.0:
            return self._rng.random() < loss
        if self._fade_change_us is None:
            self._fading = self._rng.random() < loss
            self._fade_change_us = at_us + self._span_us()
        while self._fade_change_us <= at_us:
            self._fading = not self._fading
            self._fade_change_us += self._span_us()
        return self._fading

    def _span_us(self) -> int:
        """Length of the present fade or of the clear time, exponential, so that the share of fades is ``loss``."""
        loss, burst_us = self.config.loss, self.config.burst_s * 1e6
        mean_us = burst_us if self._fading else burst_us * (1.0 - loss) / loss
        return max(round(self._rng.expovariate(1.0 / mean_us)), 1)

    def _garble(self, data: bytes) -> bytes:
        if self.config.corrupt == 0.0 or self._rng.random() >= self.config.corrupt:
            return data
        spoiled = bytearray(data)
        for _ in range(self._rng.randint(1, 4)):
            spoiled[self._rng.randrange(len(spoiled))] ^= 1 << self._rng.randrange(8)
        return bytes(spoiled)

    @property
    def is_busy(self) -> bool:
        """Whether bytes are under way, on the air or on a serial line."""
        return bool(self._flights) or any(module.is_busy for module in self.modules)

    # ---- the account --------------------------------------------------------------------------------------------

    def airtime_us(self, origin: str, since_us: int = 0, until_us: int | None = None) -> int:
        """Time that an end was on the air within a span."""
        until_us = self.now_us if until_us is None else until_us
        spans = ((item.start_us, item.end_us) for item in self.log if item.origin == origin)
        return sum(max(min(end_us, until_us) - max(start_us, since_us), 0) for start_us, end_us in spans)

    def bytes_sent(self, origin: str, since_us: int = 0) -> int:
        return sum(len(item.data) for item in self.log if item.origin == origin and item.start_us >= since_us)

    def per_second_us(self, origin: str) -> dict[int, int]:
        """Microseconds on the air in each second that has any."""
        seconds: dict[int, int] = {}
        for item in self.log:
            at_us = item.start_us
            while item.origin == origin and at_us < item.end_us:
                second = at_us // 1_000_000
                upto_us = min(item.end_us, (second + 1) * 1_000_000)
                seconds[second] = seconds.get(second, 0) + upto_us - at_us
                at_us = upto_us
        return seconds

    def worst_hour_us(self, origin: str) -> int:
        """Most airtime within any hour that ends with a packet's end: the duty-cycle rule's measure."""
        window: deque[Transmission] = deque()
        total = worst = 0
        for item in self.log:
            if item.origin != origin:
                continue
            window.append(item)
            total += item.end_us - item.start_us
            while window[0].end_us <= item.end_us - _HOUR_US:
                gone = window.popleft()
                total -= gone.end_us - gone.start_us
            partly = max(item.end_us - _HOUR_US - window[0].start_us, 0)
            worst = max(worst, total - partly)
        return worst


class RadioEnd:
    """A host's side of one module: its serial port and its two pins."""

    def __init__(self, air: Air, module: RadioModule) -> None:
        self.air = air
        self.module = module

    def write(self, data: bytes) -> int:
        """Send bytes down the serial line at the time of the last step; a serial line takes all."""
        self.module.from_host(data, self.air.now_us)
        return len(data)

    def read(self) -> bytes:
        """Return what has come by the time of the last step."""
        return self.module.read(self.air.now_us)

    def step(self, now_us: int) -> None:
        """Advance the whole radio; either end may do it."""
        self.air.step(now_us)


class RadioPair:
    """The simulated radio: ``vessel`` and ``shore`` are the two modules' hosts' sides, ``air`` the account."""

    def __init__(self, config: RadioConfig | None = None, rng: random.Random | None = None, kept: int = _KEPT) -> None:
        self.air = Air(config or RadioConfig(), rng or random.Random(0), kept)
        self.vessel = RadioEnd(self.air, self.air.modules[0])
        self.shore = RadioEnd(self.air, self.air.modules[1])

    def step(self, now_us: int) -> None:
        self.air.step(now_us)

    @property
    def is_busy(self) -> bool:
        """Whether bytes are under way, on the air or on a serial line."""
        return self.air.is_busy
