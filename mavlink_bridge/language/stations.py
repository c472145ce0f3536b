"""Who speaks to the vessel: a station is a system and a component on one link of one host, not a number alone."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final


class Proof(Enum):
    """What stands behind a sender's claim to be who it says."""

    UNSIGNED = "unsigned"
    """Nothing but that the link let it in."""
    SIGNED = "signed"
    """A MAVLink signature with the vessel's key."""
    PAGE_KEY = "page key"
    """A challenge answered with the page's key."""
    RADIO_KEY = "radio key"
    """The compact radio's key; which station of the gateway it was is the gateway's word."""


ONE_VOICE: Final = (-1, -1)
"""System and component of a link that speaks for whoever commands at its far end: numbers that no frame can carry."""


@dataclass(frozen=True, slots=True)
class Station:
    """One speaker. Two programs with the same ids on two links, or behind one link on two hosts, are two stations."""

    system: int
    component: int = 0
    link: str = ""
    """Name of the link, as the settings have it."""
    host: str = ""
    """Address of the peer without its port, which a program changes at each start."""
    radio: bool = False
    bystander: bool = False
    """Somebody at the boat's page: stops the vessel, never commands it, and its life is no station's."""

    @property
    def gateway(self) -> bool:
        """Whether it speaks for whoever commands at the far end of a radio."""
        return (self.system, self.component) == ONE_VOICE

    def __str__(self) -> str:
        if self.bystander:
            return f"the {self.link} at {self.host}"
        who = "the gateway" if self.gateway else f"station {self.system}"
        return f"{who} over {self.link}" if self.link else who

    def beside(self, other: Station) -> str:
        """As told in one breath with another: by what they differ, where their names are the same."""
        if str(self) != str(other) or self.bystander:
            return str(self)
        if self.component != other.component:
            return f"station {self.system}/{self.component} over {self.link}"
        return f"{self} at {self.host}" if self.host != other.host else str(self)


@dataclass(frozen=True, slots=True)
class Heard:
    """A station's newest HEARTBEAT of type ground station."""

    station: Station
    t_us: int
