"""Plan files: QGroundControl's, WPL's and the original installation's, read and written as one form."""

from __future__ import annotations

from .files import read_plan
from .form import PlanFile, PlanFileError
from .qgc_plan import write_plan

__all__ = ["PlanFile", "PlanFileError", "read_plan", "write_plan"]
