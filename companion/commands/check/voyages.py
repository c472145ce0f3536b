"""What ``companion check --voyage`` says: whether the hull's file still fits the boat's last voyages, and by how much not."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

from ...core.hull import VesselConfig
from ...replay.sailed_by import hull_of, moves_as
from ...settings import ConfigError
from .. import MissingExtraError, install_line
from ..progress import ProgressLine

if TYPE_CHECKING:
    from ...tuning.compare import Comparison


def voyages_fit(runs: list[Path], vessel: VesselConfig) -> bool:
    """Hold the file against the runs and print what was found; return whether it still fits, as far as they can tell."""
    if importlib.util.find_spec("scipy") is None:
        raise MissingExtraError(f"comparing with voyages needs scipy: {install_line('design')}")
    from ...tuning.compare import compare
    from ...tuning.records.copies import taken_once
    from ...tuning.voyages import read_voyage

    others = {run: hull.name for run in runs if (hull := hull_of(run)) is not None and not moves_as(hull, vessel)}
    own = [run for run in runs if run not in others]
    found = []
    for run in own or runs:
        try:
            found += read_voyage(run)
        except (OSError, ValueError) as error:
            raise ConfigError(str(run), [getattr(error, "strerror", None) or str(error)]) from None
    found = taken_once(found, _say_note)
    with ProgressLine("voyages", None) as progress:
        try:
            compared = compare(vessel, found, progress.say)
        except ValueError as error:
            raise ConfigError(", ".join(map(str, runs)), [str(error)]) from None
    for run, name in others.items():
        print(
            f"  NOTE        {run}: sailed by another hull file ('{name}'), {'left out' if own else 'and tells little of this one'}"
        )
    return _judged(compared) if own else _undecided(compared)


def _say_note(text: str) -> None:
    print(f"  NOTE        {text}")


def _judged(compared: Comparison) -> bool:
    if compared.poor:
        return _nothing(compared)
    (by_file_m, found_m), (least_m, most_m) = compared.rest_m, compared.rest_between_m
    print(
        f"  voyages     {_speeds(compared)}; way to rest from there {found_m:.1f} m ({least_m:.1f} to {most_m:.1f}), "
        f"the file reckons with {by_file_m:.1f}"
    )
    for finding in compared.findings:
        print(f"  NO LONGER   {finding}")
    if compared.runs_on:
        print(
            "  WARNING     the boat runs on farther than the guards reckon with: fit the file anew before sailing near anything"
        )
    _fits_or_unclear(compared)
    if not compared.fits:
        print("  mend        fit it anew: companion tune vessel RUN, or clean what is fouled")
    return compared.fits


def _undecided(compared: Comparison) -> bool:
    """Of voyages by other files. A law that another file has tuned answers gusts otherwise, which looks like a lighter boat: nothing is
    held against a file for it; and the way to rest, which comes out too short, is not told.
    """
    if compared.poor:
        return _nothing(compared)
    print(f"  voyages     {_speeds(compared)}")
    if compared.fits:
        _fits_or_unclear(compared)
    else:
        print("  undecided   sail by this file, and hold it against that voyage")
    return True


def _nothing(compared: Comparison) -> bool:
    """Of voyages that tell nothing: nothing is held against a file for that."""
    print(f"  voyages     {compared.seconds:.0f} s")
    print(f"  cannot tell whether the file fits these voyages: {compared.poor}")
    return True


def _fits_or_unclear(compared: Comparison) -> None:
    """What does not stand out fits only where it is told closely enough."""
    if compared.unclear:
        print(f"  cannot tell {compared.unclear}")
    elif compared.fits:
        print("  fits        the file fits these voyages")


def _speeds(compared: Comparison) -> str:
    before, now = compared.speed_mps
    return f"{compared.seconds:.0f} s: {now:.2f} m/s at 60 % throttle, the file says {before:.2f}"
