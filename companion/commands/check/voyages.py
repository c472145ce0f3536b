"""What ``companion check --voyage`` says: whether the hull's file still fits the boat's last voyages, and by how much not."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ...core.hull import VesselConfig
from ...settings import ConfigError
from .. import MissingExtraError, install_line
from ..progress import ProgressLine


def voyages_fit(runs: list[Path], vessel: VesselConfig) -> bool:
    """Hold the file against the runs and print what was found; return whether it still fits."""
    if importlib.util.find_spec("scipy") is None:
        raise MissingExtraError(f"comparing with voyages needs scipy: {install_line('design')}")
    from ...tuning.compare import compare
    from ...tuning.voyages import read_voyage

    found = []
    for run in runs:
        try:
            found += read_voyage(run)
        except (OSError, ValueError) as error:
            raise ConfigError(str(run), [getattr(error, "strerror", None) or str(error)]) from None
    with ProgressLine("voyages", None) as progress:
        try:
            compared = compare(vessel, found, progress.say)
        except ValueError as error:
            raise ConfigError(", ".join(map(str, runs)), [str(error)]) from None
    before, now = compared.speed_mps
    print(
        f"  voyages     {compared.seconds:.0f} s: {now:.2f} m/s at 60 % throttle, the file says {before:.2f}; "
        f"way to rest from there {compared.rest_m[1]:.1f} m, the file reckons with {compared.rest_m[0]:.1f}"
    )
    for finding in compared.findings:
        print(f"  NO LONGER   {finding}")
    if compared.rest_m[1] > compared.rest_m[0]:
        print(
            "  WARNING     the boat runs on farther than the guards reckon with: fit the file anew before sailing near anything"
        )
    if compared.findings:
        print("  mend        fit it anew: companion tune vessel RUN, or clean what is fouled")
    else:
        print("  fits        the file fits these voyages")
    return not compared.findings
