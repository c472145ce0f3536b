"""What a run leaves behind: recorded inputs and their replay, telemetry logs, the run's folder."""

from __future__ import annotations

from .inputs import InputReader, InputsError
from .recorder import Recorder
from .run_folders import new_run_dir
from .wrap import Recording

__all__ = ["InputReader", "InputsError", "Recorder", "Recording", "new_run_dir"]
