"""The vocabulary of plans: one frozen dataclass for each manoeuvre, named after the IMC message that it re-does.

Part of ``imc.py``, which re-exports all of it; the conventions stand there.
"""

from __future__ import annotations

from dataclasses import dataclass

from .figures import Circle, Figure


@dataclass(frozen=True, slots=True)
class Goto:
    """Sail to a point (IMC Goto). ``leg_from_here`` starts a new leg at the vessel instead of the last point."""

    seq: int
    lat_rad: float
    lon_rad: float
    hold_s: float = 0.0
    acceptance_m: float | None = None
    speed_mps: float | None = None
    leg_from_here: bool = False


@dataclass(frozen=True, slots=True)
class Loiter:
    """A figure about a point (IMC Loiter). Duration counts from reaching the path; with neither duration nor turns it is unlimited."""

    seq: int
    lat_rad: float
    lon_rad: float
    figure: Figure = Circle()  # noqa: RUF009 - frozen
    duration_s: float | None = None
    turns: float | None = None
    speed_mps: float | None = None
    exit_toward_next: bool = False


@dataclass(frozen=True, slots=True)
class ChangeSpeed:
    """Set the speed for what follows; None returns to the default (IMC DesiredSpeed inside a plan)."""

    seq: int
    speed_mps: float | None


@dataclass(frozen=True, slots=True)
class Delay:
    """Hold station for a time, or until a UTC time of day (MAV_CMD_NAV_DELAY)."""

    seq: int
    duration_s: float | None = None
    until_utc_s_of_day: float | None = None


@dataclass(frozen=True, slots=True)
class Jump:
    """Continue at ``target_seq``; after ``repeats`` jumps go on. A negative count means for ever (MAV_CMD_DO_JUMP)."""

    seq: int
    target_seq: int
    repeats: int


@dataclass(frozen=True, slots=True)
class ReturnHome:
    """Sail to the nearest rally point or home and hold there (MAV_CMD_NAV_RETURN_TO_LAUNCH)."""

    seq: int


@dataclass(frozen=True, slots=True)
class SetHome:
    """Make a position, or the present one when None, the home (MAV_CMD_DO_SET_HOME)."""

    seq: int
    lat_rad: float | None = None
    lon_rad: float | None = None


@dataclass(frozen=True, slots=True)
class FenceEnable:
    """Switch the fence inside a plan (MAV_CMD_DO_FENCE_ENABLE)."""

    seq: int
    enable: bool


@dataclass(frozen=True, slots=True)
class Noted:
    """An item that a boat accepts, logs and passes over: cameras, regions of interest."""

    seq: int
    command: int
    name: str = ""
    """What the protocol that brought it calls the command."""


Maneuver = Goto | Loiter | ChangeSpeed | Delay | Jump | ReturnHome | SetHome | FenceEnable | Noted


@dataclass(frozen=True, slots=True)
class PlanSpecification:
    """A compiled plan: one manoeuvre for each mission item, in wire order without a home item."""

    maneuvers: tuple[Maneuver, ...] = ()
    plan_id: int = 0
    """CRC-32 of the canonical items; 0 = no plan."""

    def has_same(self, old: PlanSpecification, seq: int) -> bool:
        """Whether item ``seq`` is as it was in ``old``."""
        return seq < len(self.maneuvers) and self.maneuvers[seq : seq + 1] == old.maneuvers[seq : seq + 1]

    def goes_on_from(self, old: PlanSpecification, seq: int) -> bool:
        """Whether who sails item ``seq`` of ``old`` goes on there: what comes before it is the same, or the place that it leads to is.

        Nothing comes before the first item: another one there is another plan.
        """
        if self.maneuvers == old.maneuvers:
            return True
        if seq >= len(self.maneuvers):
            return False
        if seq and self.maneuvers[:seq] == old.maneuvers[:seq]:
            return True
        return self.has_same(old, seq) and isinstance(self.maneuvers[seq], Goto | Loiter)


@dataclass(frozen=True, slots=True)
class FenceArea:
    """One fence element: a polygon (vertices) or a circle (centre and radius), inclusion or exclusion."""

    inclusion: bool
    vertices_rad: tuple[tuple[float, float], ...] = ()
    centre_rad: tuple[float, float] | None = None
    radius_m: float | None = None
