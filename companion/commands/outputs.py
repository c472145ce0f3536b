"""What no command writes over: what it reads itself, and what nobody can make again (a store, a configuration, a recording)."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from ..io.keeping.file import is_strange
from ..settings import ConfigError

_RECORDED: Final = (".tlog", ".bin", ".jsonl")
"""Endings of what a run writes and no command does."""
_ABOUT: Final = "run.json"
"""A run's folder has it; a table beside it is of that run."""
_LONGEST: Final = 1_000_000
"""Bytes of a configuration at most; a file that is longer is none, and costs no reading."""

Tables = Mapping[str, Any]


def _never(tables: Tables) -> bool:
    """A command that writes no TOML."""
    return False


def may_write(out: Path | None, *read: Path | None, is_own: Callable[[Tables], bool] = _never) -> None:
    """Raises ConfigError for a file that would be lost; ``None`` is standard output.

    ``read``: what the command reads, folders too. ``is_own``: whether the tables of a TOML file are of this command's making.
    """
    if out is None or out.is_dir():
        return
    if not out.exists() and out.suffix in _RECORDED:
        raise ConfigError(
            str(out), [f"{out.suffix} is the ending of a recording, which no command writes; name another file"]
        )
    if not out.is_file():
        return
    if any(out.samefile(each) for each in _files(read)):
        raise ConfigError(str(out), ["is what this command reads, and is not written over; name another file"])
    if what := _kept(out.resolve(), is_own):
        raise ConfigError(str(out), [f"is {what}, and is not written over; name another file"])


def _files(read: tuple[Path | None, ...]) -> Iterator[Path]:
    for path in read:
        if path is None:
            continue
        if path.is_file():
            yield path
        elif path.is_dir():
            yield from (each for each in path.iterdir() if each.is_file() and _is_recorded(each))


def _kept(path: Path, is_own: Callable[[Tables], bool]) -> str:
    """What a file is that must stay, in words; empty for any other."""
    if _is_recorded(path):
        return "part of a recording"
    if path.stat().st_size and not is_strange(path):
        return "a boat's store"
    tables = _tables(path)
    return "" if tables is None or is_own(tables) else "a TOML file of another kind (a configuration?)"


def _is_recorded(path: Path) -> bool:
    in_a_run = path.suffix == ".csv" and (path.parent / _ABOUT).is_file()
    return in_a_run or path.suffix in _RECORDED or path.name == _ABOUT


def _tables(path: Path) -> Tables | None:
    """Content of a TOML file, nothing of one that cannot be read; None for another file."""
    if path.stat().st_size > _LONGEST:
        return None
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig")) or None
    except (ValueError, RecursionError):  # no TOML, or none that anybody wrote: nested beyond what can be read
        return {} if path.suffix == ".toml" else None
