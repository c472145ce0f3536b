"""What is expected of the actuator board's pins: pulses, each within so much."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from companion.core.config import Config


class Pulses(Config):
    """Pulses at the board's pins, us; one that is not named is free."""

    thruster_port: float | None = None
    thruster_starboard: float | None = None
    rudder_port: float | None = None
    rudder_starboard: float | None = None
    within: float = Field(5.0, gt=0)

    @property
    def wanted(self) -> tuple[float | None, ...]:
        """In the order of the pins."""
        return self.thruster_port, self.thruster_starboard, self.rudder_port, self.rudder_starboard

    @property
    def shown(self) -> str:
        """As a limit."""
        return f"{in_words(self.wanted)} +- {self.within:g}"

    def hold(self, pulses_us: Sequence[float]) -> bool:
        """Whether these are they."""
        pairs = zip(pulses_us, self.wanted, strict=True)
        return all(wanted is None or abs(pulse - wanted) <= self.within for pulse, wanted in pairs)


def in_words(pulses: Sequence[float | None]) -> str:
    """In one line."""
    return " ".join("-" if pulse is None else f"{pulse:.0f}" for pulse in pulses)
