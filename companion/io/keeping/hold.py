"""One process at a time sails by a store: a lock beside it that ends with its process, however that ends.

Two would each believe that they have the vessel, and acknowledge plans into one file. Looking at a store, and adopting what
waits in it, take no lock.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from ..log_file import make_own_folder

_TOLD_BYTES: Final = 200
"""More than a process and its time take; whatever else lies there is not shown."""


class HeldError(Exception):
    """Who has the store, in words for an operator."""


@contextlib.contextmanager
def hold(store: Path) -> Iterator[None]:
    """Have a store for oneself. Raises HeldError when another process has it; where no lock can be had, goes on without."""
    place = Path(os.path.realpath(store))
    lock = _opened(place.with_name(f"{place.name}.lock"))
    try:
        if lock is not None:
            _lock(lock)
        yield
    finally:
        if lock is not None:
            os.close(lock)


def _opened(path: Path) -> int | None:
    """The lock's file; None on a disk that takes none: there the store keeps nothing that could be shared."""
    if sys.platform == "win32":  # a gateway's; two on one store are not told apart there
        return None
    with contextlib.suppress(OSError):
        make_own_folder(path.parent)
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    with contextlib.suppress(OSError):
        return os.open(path, os.O_RDONLY | os.O_CLOEXEC)  # of another user
    return None


def _lock(lock: int) -> None:
    if sys.platform == "win32":
        return
    import fcntl  # not on Windows, where the gateway runs too

    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise HeldError(_holder(lock)) from None
    except OSError:
        return  # a disk without locks
    with contextlib.suppress(OSError):
        os.ftruncate(lock, 0)
        os.write(lock, f"{os.getpid()} {datetime.now(UTC):%Y-%m-%d %H:%M} UTC".encode())


def _holder(lock: int) -> str:
    """Who holds it, as he has written himself; a process that is gone is not he."""
    number, _, since = os.read(lock, _TOLD_BYTES).decode(errors="replace").partition(" ")
    if not number.isdecimal() or not _runs(int(number)):
        return "another process has it; stop that one first"
    return f"process {number} has it since {since}; stop that one first: kill {number}"


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return True
