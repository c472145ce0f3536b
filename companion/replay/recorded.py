"""By whose hull a run was sailed: the recording of inputs holds the whole file, wherever it has gone since."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.hull import VesselConfig
from ..io.recording import InputReader, InputsError
from ..settings.moved import carry_over
from .run import ReplayError, vessel_of


def recorded_vessel(run_dir: Path) -> VesselConfig:
    """Return the hull by whose file a run was sailed. Raises ReplayError where the run does not hold it."""
    meta = _meta(run_dir)
    try:
        hull = copy.deepcopy(dict(meta["vessel"]))
        carry_over(copy.deepcopy(dict(meta["settings"])), hull)
        return vessel_of(hull)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ReplayError(f"{run_dir / 'inputs.bin'}: holds no hull of this program's ({error})") from None


def recorded_heading_latency_s(run_dir: Path) -> float | None:
    """The greatest age of headings that a run's settings say of its sensors; None where the run does not hold it. Raises ReplayError."""
    try:
        return max(float(item["nmea"]["heading_latency_s"]) for item in _meta(run_dir)["settings"]["sensors"])
    except (AttributeError, KeyError, TypeError, ValueError):
        return None


def _meta(run_dir: Path) -> Mapping[str, Any]:
    path = run_dir / "inputs.bin"
    try:
        reader = InputReader(path)
    except (OSError, InputsError) as error:
        raise ReplayError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    reader.close()
    return reader.meta
