"""Reading ``run.json``, what a run was of: a card may have damaged it in any way, and a person may hand over any file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

ABOUT: Final = "run.json"


class AboutError(ValueError):
    """It is there and cannot be read."""


def read_about(run_dir: Path) -> dict[str, Any]:
    """Return a run's description. Raises FileNotFoundError, and AboutError for one that holds something else."""
    try:
        about = json.loads((run_dir / ABOUT).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise
    except (OSError, ValueError, RecursionError) as error:
        raise AboutError(getattr(error, "strerror", None) or str(error)) from None
    if not isinstance(about, dict):
        raise AboutError("holds no object")
    return about
