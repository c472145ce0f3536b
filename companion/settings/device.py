"""Places that are no files: a device may have no end, and opening one may set something going (a serial line resets its board)."""

from __future__ import annotations

import errno
import stat
from pathlib import Path


def no_device(path: Path) -> Path:
    """Return the path of what is to be read whole. Raises OSError for a device, and for what is not there."""
    mode = path.stat().st_mode
    if stat.S_ISCHR(mode) or stat.S_ISBLK(mode):
        raise OSError(errno.EINVAL, "is a device; name a file", str(path))
    return path
