"""Which hull file a run was sailed by, and whether another file says of the same motion the same."""

from __future__ import annotations

from pathlib import Path

from ..core.hull import VesselConfig
from . import ReplayError, recorded_heading_latency_s, recorded_vessel


def folder_of(run: Path) -> Path:
    """The run's folder, where its table itself is named and the rest lies beside it; else what is named."""
    beside = run.name == "control.csv" and (run.parent / "inputs.bin").is_file()
    return run.parent if beside else run


def hull_of(run: Path) -> VesselConfig | None:
    """The hull file that a run was sailed by; None where that is not known: a log from elsewhere, a run without its inputs."""
    try:
        return recorded_vessel(folder_of(run))
    except ReplayError:
        return None


def heading_latency_of(run: Path) -> float | None:
    """The age of headings that a run's settings reckoned with, s; None where that is not known."""
    try:
        return recorded_heading_latency_s(folder_of(run))
    except ReplayError:
        return None


def moves_as(one: VesselConfig, other: VesselConfig) -> bool:
    """Whether a law and an estimator make the same of both; a sounder's place or a name changes nothing."""
    return (one.hull, one.thruster, one.rudder, one.windage) == (
        other.hull,
        other.thruster,
        other.rudder,
        other.windage,
    )


def same_boat(one: VesselConfig, other: VesselConfig) -> bool:
    """Whether both may be files of one boat: no fit changes her size, her mass, or what she is driven and steered by."""
    return _built(one) == _built(other)


def _built(vessel: VesselConfig) -> tuple[float, ...]:
    hull, thruster = vessel.hull, vessel.thruster
    return hull.length_m, hull.m11_kg, thruster.count, thruster.lateral_m, vessel.rudder.count
