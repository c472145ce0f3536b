"""What a module's numbers mean, as far as somebody has found out: air rates behind indexes, frequencies behind channels.

The vendor publishes neither. ``companion lora bench`` writes down what his tool shows, or what was measured; the rest stays "index 4".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from .module import ModuleError

_INDEXES: Final = 10
_RATES: Final = (50, 500_000)
"""bit/s: nothing that LoRa does is outside."""
_MHZ: Final = (137.0, 1020.0)
_NONE: Final[Mapping[Any, Any]] = {}


@dataclass(frozen=True)
class ModuleCodes:
    """``rates``: index to bit/s; ``mhz``: (band's code, channel) to MHz."""

    rates: Mapping[int, int] = field(default_factory=dict)
    mhz: Mapping[tuple[int, int], float] = field(default_factory=dict)

    def index_of(self, rate: int) -> int | None:
        """The index of an air rate."""
        return next((index for index, known in self.rates.items() if known == rate), None)

    def learned(self, block: bytes, name: str, value: str) -> ModuleCodes:
        """With one more fact about the settings that the module has now. Raises ModuleError."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        low, high = {"rate": _RATES, "mhz": _MHZ}.get(name, (math.nan, math.nan))
        if not low <= number <= high:
            raise ModuleError(f"{name} = {value}: give rate=BITS_PER_SECOND or mhz=FREQUENCY; nothing was written down")
        if name == "rate":
            return replace(self, rates={**self.rates, block[2]: round(number)})
        return replace(self, mhz={**self.mhz, (block[1], block[0]): number})

    def as_toml(self) -> str:
        """The file of them."""
        lines = ["# What companion lora bench was told about this kind of module.", "[rates]"]
        lines += [f"{index} = {rate}" for index, rate in sorted(self.rates.items())]
        lines += ["", "[mhz]", *(f'"{band}/{channel}" = {mhz}' for (band, channel), mhz in sorted(self.mhz.items()))]
        return "\n".join(lines) + "\n"


def read_codes(data: Mapping[str, Any]) -> ModuleCodes:
    """From a file's tables. Raises ModuleError for what is none."""
    try:
        rates = {int(index): int(rate) for index, rate in data.get("rates", _NONE).items()}
        places = {key: key.split("/") for key in data.get("mhz", _NONE)}
        mhz = {(int(band), int(channel)): float(data["mhz"][key]) for key, (band, channel) in places.items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise ModuleError(f"no file of codes: {error}") from None
    if not all(0 <= index < _INDEXES for index in rates):
        raise ModuleError(f"no file of codes: an index is 0 to {_INDEXES - 1}")
    return ModuleCodes(rates, mhz)
