"""Files that are there whole or not at all: written beside their place and moved there when they are complete.

Whoever interrupts the work, and every fault of the disk, leaves the file before as it was, and nothing half beside it.
What is no file (a terminal, ``/dev/null``, a pipe) is written as it is: it must not be replaced.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the name to write under; it becomes ``path`` at the end. Raises OSError with ``path`` as its name."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        yield path
        return
    target = path.resolve() if path.is_symlink() else path
    beside = target.with_name(f".{target.name}.part")
    try:
        yield beside
        beside.replace(target)
    except OSError as error:
        if error.filename not in (None, str(beside)):  # None: while it was being written
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from None
    finally:
        _remove(beside)


@contextmanager
def filled_folder(folder: Path) -> Iterator[None]:
    """A folder for what is written meanwhile; one that is new and stays empty goes again."""
    is_new = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        if is_new:
            with suppress(OSError):  # it holds something
                folder.rmdir()


def write_whole(path: Path, data: bytes) -> None:
    """Write a file in one go, whole or not at all. Raises OSError with ``path`` as its name."""
    with whole_file(path) as beside:
        beside.write_bytes(data)


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        return  # the folder is a file, or is not to be written: then there is nothing of ours in it
