"""A restart of the simulated vessel, as a ground station asks for it: the boat's program ends and begins anew, its world does not.

The new start has a run folder of its own, the same store, and finds the vessel lying where it was. Nothing starts by itself.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from companion.worlds import STORE_NAME

from .world import World

TOLD: Final = "a ground station asked for a restart: the vessel's program begins anew, where the vessel lies"


@dataclass(frozen=True, slots=True)
class Berth:
    """Where a vessel lies: metres from where its world began, and its heading."""

    north_m: float
    east_m: float
    psi_rad: float

    def moor(self, world: World) -> None:
        """Lay the vessel of a new world there, at rest."""
        world.surroundings.plant.vessel.place(north_m=self.north_m, east_m=self.east_m, psi_rad=self.psi_rad)


def moor(arguments: argparse.Namespace, world: World) -> None:
    """Lay the vessel where the start before this one left it; a first start leaves it where the world begins."""
    berth: Berth | None = getattr(arguments, "berth", None)
    if berth is not None:
        berth.moor(world)


def is_wanted(world: World) -> bool:
    """Whether the program ended to begin anew: a restart was obeyed, and no shutdown."""
    return world.stop_wanted and not world.app.shutdown_wanted


def next_start(arguments: argparse.Namespace, world: World, run_dir: Path) -> argparse.Namespace:
    """The command line of the next start. The run folder that the user named is followed by one beside it."""
    truth, given = world.surroundings.truth, arguments.run_dir
    count = getattr(arguments, "starts", 1) + 1
    first = getattr(arguments, "first_run_dir", given)
    rest_s = None if arguments.duration is None else max(1e-3, arguments.duration - world.now_us * 1e-6)
    changed = {
        "berth": Berth(truth.north_m, truth.east_m, truth.psi_rad),
        "starts": count,
        "first_run_dir": first,
        "run_dir": None if first is None else first.with_name(f"{first.name}-{count}"),
        "store": arguments.store or run_dir / STORE_NAME,
        "copy_store": False,
        "plan": None,
        "start": False,
        "duration": rest_s,
    }
    return argparse.Namespace(**{**vars(arguments), **changed})
