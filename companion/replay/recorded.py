"""By whose hull a run was sailed: the recording of inputs holds the whole file, wherever it has gone since."""

from __future__ import annotations

import copy
from pathlib import Path

from ..core.hull import VesselConfig
from ..io.recording import InputReader, InputsError
from ..settings.moved import carry_over
from .run import ReplayError, vessel_of


def recorded_vessel(run_dir: Path) -> VesselConfig:
    """Return the hull by whose file a run was sailed. Raises ReplayError where the run does not hold it."""
    path = run_dir / "inputs.bin"
    try:
        reader = InputReader(path)
    except (OSError, InputsError) as error:
        raise ReplayError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    reader.close()
    try:
        hull = copy.deepcopy(dict(reader.meta["vessel"]))
        carry_over(copy.deepcopy(dict(reader.meta["settings"])), hull)
        return vessel_of(hull)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise ReplayError(f"{path}: holds no hull of this program's ({error})") from None
