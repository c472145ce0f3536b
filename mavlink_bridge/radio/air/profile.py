"""Radio profiles: frequency, rule of the band, power, modulation and habits of the link in one validated model.

A profile that contradicts itself or the rule it claims is refused with the rule's name. Bands and limits: ETSI EN 300
220-2 as tabulated in docs/LORA.md; an engineering reading, not legal advice. The power of each level of the module is
not published: ``rated_dbm`` is an assumption until measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..codec.batch import FIRST_BITS, SAMPLE_BITS
from ..codec.state import KEY_BYTES
from ..codec.wire import MAX_FRAME, OVERHEAD
from .airtime import PACKET_BYTES, PHYS, Phy, packet_us

_DIPOLE_DBI: Final = 2.15
_LEVEL_STEP_DB: Final = 3.0
_CHANNEL_20_MHZ: Final = 868.92
_CHANNEL_STEP_MHZ: Final = 0.6


_KEY_STATE_BYTES: Final = KEY_BYTES + OVERHEAD
_THRIFTY_HOUR_US: Final = 36_000_000
"""One per cent of the time: twelve seconds of repeated orders, at half of the air, are a sixth of it."""
_BETWEEN_US: Final = 120_000
"""What the shore keeps clear before and after a state of the vessel's."""
STOP_BYTES: Final = OVERHEAD + 4
"""Count, number, code and station; the answer is no longer."""
MODULE_US: Final = 10_000
"""Allowed for the module to notice the end of a write."""


def channel_mhz(channel: int) -> float:
    """Frequency of a channel of the 868 MHz band: the original's 868.92 MHz at 20, and a sister module's steps."""
    return _CHANNEL_20_MHZ + _CHANNEL_STEP_MHZ * (channel - 20)


def batch_bytes(count: int) -> int:
    """Frame that holds so many samples."""
    return math.ceil((FIRST_BITS + SAMPLE_BITS * (count - 1)) / 8) + OVERHEAD


@dataclass(frozen=True, slots=True)
class BandRule:
    """One line of EN 300 220-2."""

    name: str
    low_mhz: float
    high_mhz: float
    erp_dbm: float
    duty: float | None
    """Share of an hour; None = no limit."""

    @property
    def title(self) -> str:
        share = "no duty limit" if self.duty is None else f"{self.duty * 100:g} % duty cycle"
        return f"EN 300 220-2 band {self.name} ({self.low_mhz:g}-{self.high_mhz:g} MHz, {self.erp_dbm:g} dBm e.r.p., {share})"


RULES: Final = {
    rule.name: rule
    for rule in (
        BandRule("K", 863.0, 865.0, 14.0, 0.001),
        BandRule("L", 865.0, 868.0, 14.0, 0.01),
        BandRule("M", 868.0, 868.6, 14.0, 0.01),
        BandRule("N", 868.7, 869.2, 14.0, 0.001),
        BandRule("O", 869.4, 869.65, 27.0, 0.10),
        BandRule("P", 869.7, 870.0, 7.0, None),
        BandRule("Q", 869.7, 870.0, 14.0, 0.01),
    )
}
BENCH: Final = BandRule("bench", 0.0, 10_000.0, -30.0, None)
"""A dummy load on the bench: what leaks is far below every limit."""


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class LinkSettings(_Model):
    """Habits of the compact link under this profile."""

    state_s: float = Field(5.0, ge=1.0, le=3600.0)
    """Between two states. The ledger may stretch it."""
    key_s: float = Field(60.0, ge=5.0, le=86400.0)
    """Longest time between two key states."""
    batch: int = Field(1, ge=1, le=14)
    """States collected into one packet; 1 = each is sent at once."""
    beacon_s: float = Field(30.0, ge=0.0, le=600.0)
    """Between the gateway's signs of life; 0 = none, and the vessel cannot notice that the ground station is gone."""
    stale_after_s: float = Field(20.0, ge=2.0, le=86400.0)
    """Heartbeats to ground stations stop when the last authentic state is older."""
    command_s: float = Field(12.0, ge=2.0, le=600.0)
    """A command without an answer is failed after this."""
    upload_s: float = Field(45.0, ge=5.0, le=3600.0)
    """An upload that the vessel has not confirmed is failed after this."""
    texts: bool = True
    """The vessel's warnings cross the air."""
    turnaround_ms: float = Field(150.0, ge=50.0, le=5000.0)
    """Everything between the end of one packet and the start of its answer: modules, serial lines, ticks."""
    gap_ms: float = Field(100.0, ge=100.0, le=5000.0)
    """Least time off the air between two packets."""


class RadioProfile(_Model):
    """One radio profile. Both ends use the same one, except for their node ids."""

    title: str = ""
    rule: Literal["K", "L", "M", "N", "O", "P", "Q", "bench"]
    frequency_mhz: float = Field(ge=863.0, le=870.0)
    frequency_measured: bool = False
    """True: the frequency was read in the vendor's tool or measured, so the channel need not fit the assumed 0.6 MHz steps."""
    band: int = Field(3, ge=1, le=4)
    """Module's band code: 3 = 868 MHz."""
    channel: int = Field(ge=0, le=255)
    air_rate: float = Field(656.0, gt=0.0)
    """As the vendor's tool shows it, bit/s."""
    rate_index: int | None = Field(None, ge=0, le=9)
    """The module's code of the air rate; unset = leave the module's own."""
    power_level: int = Field(ge=0, le=7)
    rated_dbm: float = Field(30.0, ge=0.0, le=37.0)
    """Conducted power at level 7; each level below is taken as 3 dB less. Assumed until measured."""
    attenuation_db: float = Field(0.0, ge=0.0, le=100.0)
    """Cable and attenuators between module and antenna."""
    antenna_dbi: float = Field(_DIPOLE_DBI, ge=-20.0, le=20.0)
    net_id: str = Field("11111111", pattern=r"^[0-9A-Fa-f]{8}$")
    node_vessel: str = Field("BBBB", pattern=r"^[0-9A-Fa-f]{4}$")
    node_shore: str = Field("BBBC", pattern=r"^[0-9A-Fa-f]{4}$")
    baud: int = 9600
    parity: Literal["none", "odd", "even"] = "none"
    data_bits: Literal[7, 8] = 8
    stop_bits: Literal[1, 2] = 1
    mesh: bool = False
    role: Literal["node", "router", "node+router"] = "node"
    encryption: bool = False
    """The module's own AES: pads to 16 bytes, authenticates nothing; leave it off."""
    lbt: bool = False
    """The module's listen-before-talk box: a courtesy, it buys no airtime."""
    phy: str = "A"
    """What the air rate is taken for, by name in airtime.PHYS."""
    module_header_bytes: int = Field(0, ge=0, le=32)
    max_packet_s: float = Field(1.0, gt=0.0, le=4.0)
    """Longest transmission."""
    entity_label: str = ""
    """The seed's Entity Label: labels the log."""
    link: LinkSettings = LinkSettings()

    @model_validator(mode="after")
    def _legal(self) -> RadioProfile:
        mistakes = list(self._mistakes())
        if mistakes:
            raise ValueError("; ".join(mistakes))
        return self

    def _mistakes(self) -> list[str]:
        found: list[str] = []
        if self.phy not in PHYS:
            return [f"phy = {self.phy!r}: choose one of {', '.join(PHYS)}"]
        half_mhz = self.modulation.bandwidth_hz / 2e6
        rule = self.band_rule
        if self.frequency_mhz - half_mhz < rule.low_mhz or self.frequency_mhz + half_mhz > rule.high_mhz:
            found.append(
                f"{self.frequency_mhz:g} MHz with {half_mhz * 2000:g} kHz bandwidth is not inside {rule.title}"
            )
        if self.erp_dbm > rule.erp_dbm + 0.01:
            found.append(
                f"power level {self.power_level} is {self.erp_dbm:.1f} dBm e.r.p., {self.erp_dbm - rule.erp_dbm:.1f} dB over "
                f"{rule.title}; lower power_level or say what lies between module and antenna (attenuation_db)"
            )
        expected_mhz = channel_mhz(self.channel)
        if not self.frequency_measured and abs(expected_mhz - self.frequency_mhz) > 0.001:
            found.append(
                f"channel {self.channel} should be {expected_mhz:.2f} MHz, not {self.frequency_mhz:g}; "
                "set frequency_measured = true when it was measured"
            )
        return found + self._link_mistakes()

    def _link_mistakes(self) -> list[str]:
        found: list[str] = []
        if self.node_vessel.upper() == self.node_shore.upper():
            found.append("node_vessel and node_shore must differ")
        if self.role != "node" and not self.mesh:
            found.append(f"role = {self.role!r} needs mesh = true")
        rate = self.modulation.bit_rate
        if not 0.93 <= rate / self.air_rate <= 1.07:
            found.append(f"phy {self.phy} is {rate:.0f} bit/s, not the air_rate of {self.air_rate:g}")
        if self.max_frame_bytes < 24:
            found.append(
                f"packets of {self.max_packet_s:g} s hold only {self.max_frame_bytes} bytes; the link needs 24"
            )
        if self.link.stale_after_s < self.link.state_s * self.link.batch * 1.5:
            found.append("link.stale_after_s must be at least 1.5 times the time between two state packets")
        return found + self._size_mistakes()

    def _size_mistakes(self) -> list[str]:
        """What the longest packet has no room for."""
        longest, link = self.max_frame_bytes, self.link
        if link.batch > 1:
            fits = [count for count in range(1, 15) if batch_bytes(count) <= longest]
            if link.batch > max(fits, default=0):
                size = batch_bytes(link.batch)
                return [
                    f"link.batch = {link.batch}: {size} bytes, {self.airtime_us(size) / 1e6:.2f} s on the air, are longer than "
                    f"max_packet_s = {self.max_packet_s:g}; set link.batch = {max(fits, default=1)} or raise max_packet_s"
                ]
            return []
        least_s = (self.span_us(_KEY_STATE_BYTES) + self.span_us(longest) + _BETWEEN_US) * 1e-6
        if link.state_s < least_s:
            return [
                f"link.state_s = {link.state_s:g}: a piece of a plan, {longest} bytes, has no room between two states; "
                f"set link.state_s = {math.ceil(least_s * 10) / 10:g} or more, or lower max_packet_s"
            ]
        return []

    @property
    def modulation(self) -> Phy:
        return PHYS[self.phy]

    @property
    def band_rule(self) -> BandRule:
        return BENCH if self.rule == "bench" else RULES[self.rule]

    @property
    def erp_dbm(self) -> float:
        """Effective radiated power: conducted, less cable, plus the antenna's gain over a dipole."""
        conducted_dbm = self.rated_dbm - _LEVEL_STEP_DB * (7 - self.power_level)
        return conducted_dbm - self.attenuation_db + self.antenna_dbi - _DIPOLE_DBI

    @property
    def hour_us(self) -> int | None:
        """Airtime of one transmitter in an hour; None = no limit."""
        duty = self.band_rule.duty
        return None if duty is None else round(duty * 3_600_000_000)

    @property
    def is_thrifty(self) -> bool:
        """Whether each message counts: an order repeated as fast as its answer may come would spend an hour's airtime in seconds."""
        return self.hour_us is not None and self.hour_us < _THRIFTY_HOUR_US

    @property
    def max_frame_bytes(self) -> int:
        """Longest frame that is one packet and no longer than ``max_packet_s``."""
        sizes = range(min(MAX_FRAME, PACKET_BYTES), 0, -1)
        return next((size for size in sizes if self.airtime_us(size) <= self.max_packet_s * 1e6), 0)

    def airtime_us(self, size: int) -> int:
        return packet_us(size, self.modulation, self.module_header_bytes)

    @property
    def stop_us(self) -> int:
        """What a stop, or the vessel's answer to it, is on the air."""
        return self.airtime_us(STOP_BYTES)

    def span_us(self, size: int) -> int:
        """From the write to the end on the air, for what is one packet."""
        return round(size * self.serial_byte_us) + MODULE_US + self.airtime_us(size)

    @property
    def serial_byte_us(self) -> float:
        return 1e6 * (1 + self.data_bits + self.stop_bits + (self.parity != "none")) / self.baud
