"""Reads a depth map from a file: soundings as XYZ, CSV or DUNE ini, or a grid that this software stored."""

from __future__ import annotations

from pathlib import Path

from ..core.guard.depth.grid import DepthGrid, build
from ..core.guard.depth.soundings import Order, cell_of, parse
from ..settings.device import no_device


def load_depth_map(path: Path, pitch_m: float = 5.0, spread_m: float = 10.0, order: Order = "lon-lat") -> DepthGrid:
    """Return the grid of a file. Raises ``OSError``, or ``ValueError`` with the file's name and what is wrong with it."""
    data = no_device(path).read_bytes()
    try:
        if path.suffix == ".depth":
            return DepthGrid.from_bytes(data)
        text = data.decode("utf-8")
        return build(parse(text, path.name, order), pitch_m, spread_m, cell_of(text))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
