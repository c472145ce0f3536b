"""How long a LoRa packet is on the air: Semtech's formula and the settings that the module's 656 bit/s may stand for.

Source: SX1272/76 data sheet, "Time on air"; the candidates are those of docs/LORA.md. Times in integer microseconds,
rounded up, so that a ledger fed with them never counts too little.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

PACKET_BYTES: Final = 62
"""Most bytes that the module puts into one packet; longer writes are split."""


@dataclass(frozen=True, slots=True)
class Phy:
    """Modulation: spreading factor 6...12, bandwidth in Hz, coding rate 4/(4 + cr) with cr 1...4, low-rate optimisation."""

    spreading: int
    bandwidth_hz: float
    cr: int
    low_rate: bool = False
    preamble: int = 8

    @property
    def symbol_us(self) -> float:
        return 2.0**self.spreading / self.bandwidth_hz * 1e6

    @property
    def bit_rate(self) -> float:
        """Nominal bit/s, preamble and header left out."""
        bits = self.spreading - (2 if self.low_rate else 0)
        return bits * self.bandwidth_hz / 2.0**self.spreading * 4 / (4 + self.cr)


PHYS: Final[Mapping[str, Phy]] = {
    "A": Phy(10, 125e3, 2, low_rate=True),
    "B": Phy(11, 250e3, 4),
    "C": Phy(8, 31.25e3, 2),
    "SF12": Phy(12, 125e3, 1, low_rate=True),
    "SF10": Phy(10, 125e3, 1),
    "SF9": Phy(9, 125e3, 1),
    "SF8": Phy(8, 125e3, 1),
    "SF7": Phy(7, 125e3, 1),
    "SF7W": Phy(7, 250e3, 1),
}
"""A, B, C: what 656 bit/s may be (A is what this project counts with); the others are faster or slower settings for comparison."""


def packet_us(size: int, phy: Phy, header_bytes: int = 0) -> int:
    """Time on air of one packet of ``size`` bytes plus the module's own header: explicit LoRa header, CRC on."""
    bits = 8 * (size + header_bytes) - 4 * phy.spreading + 28 + 16
    per_block = 4 * (phy.spreading - (2 if phy.low_rate else 0))
    symbols = phy.preamble + 4.25 + 8 + max(math.ceil(bits / per_block), 0) * (phy.cr + 4)
    return math.ceil(symbols * phy.symbol_us)


def write_us(size: int, phy: Phy, header_bytes: int = 0) -> int:
    """Time on air of one write, cut into packets by the module."""
    whole, rest = divmod(size, PACKET_BYTES)
    total = whole * packet_us(PACKET_BYTES, phy, header_bytes)
    return total + (packet_us(rest, phy, header_bytes) if rest else 0)
