"""What a run's files were when they were closed: a checksum of each in ``run.json``, so that one flipped bit is seen later.

A run that was killed has none; its inputs carry checksums of their own. Truth of a simulation is not in it.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

from ..log_file import LogFile
from .about import ABOUT, AboutError, read_about

KEY: Final = "crc32"
MISSING: Final = "missing"
"""What of the run never came onto the disk, and why, in words."""
_CHUNK: Final = 1 << 20


def digests_of(files: Iterable[LogFile], about: Mapping[str, Any]) -> dict[str, str]:
    """Checksums by file name, of every part that was written from its beginning; the description's own too."""
    found = {name: f"{crc:08x}" for file in files for name, crc in file.sums.items() if crc is not None}
    return {**found, ABOUT: _of_about(about)}


def damaged(run_dir: Path) -> tuple[str, ...]:
    """Names of the run's files that are not what they were when they were closed; what is gone is not judged.

    A description that cannot be read is damaged; one without checksums is of a run that was killed, or of the first release.
    """
    try:
        about = read_about(run_dir)
    except FileNotFoundError:
        return ()
    except AboutError:
        return (ABOUT,)
    kept = about.pop(KEY, {})
    if not isinstance(kept, dict):
        return (ABOUT,)
    wrong = [ABOUT] if kept and _of_about(about) != kept.get(ABOUT) else []
    names = [name for name in kept if name != ABOUT]
    return (*wrong, *(name for name in names if _of_file(run_dir / Path(name).name) not in (None, kept[name])))


def never_kept(run_dir: Path) -> str:
    """What of the run was never recorded, in words; empty for all of it, and for a run that was killed."""
    try:
        return str(read_about(run_dir).get(MISSING, ""))
    except (FileNotFoundError, AboutError):
        return ""


def _of_about(about: Mapping[str, Any]) -> str:
    plain = {key: value for key, value in about.items() if key != KEY}
    return f"{zlib.crc32(json.dumps(plain, sort_keys=True, default=str).encode()):08x}"


def _of_file(path: Path) -> str | None:
    crc = 0
    try:
        with path.open("rb") as file:
            while chunk := file.read(_CHUNK):
                crc = zlib.crc32(chunk, crc)
    except OSError:
        return None
    return f"{crc:08x}"
