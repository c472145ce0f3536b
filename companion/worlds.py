"""Keeping worlds apart: what a simulation uses in place of a boat's own store, runs and keys.

A simulation of a boat's file reads that file, its vessel, its charts and its keys, and changes none of them: plans and parameters
go into a store beside the simulation's own run, runs into a folder of their own.
"""

from __future__ import annotations

import json
import random
from collections.abc import Sequence
from hashlib import blake2s
from pathlib import Path
from typing import Final, TypeVar

from .io.keeping import AnyStore, MemoryStore, Store, StoreContent
from .io.keeping.content import StoredRow, rows_of
from .io.keeping.file import make_new
from .io.keeping.look import look
from .io.keeping.mark import WorldKind, marks, new_vessel_id
from .io.log_file import make_own_folder
from .io.recording.about import AboutError, read_about
from .io.writer import Writer
from .settings import ConfigError, Settings

AnySettings = TypeVar("AnySettings", bound=Settings)
STORE_NAME: Final = "companion.db"
"""The store of a simulated run, in its directory."""
_SUFFIX: Final = "-sim"


def apart(settings: AnySettings, overrides: Sequence[str] = ()) -> AnySettings:
    """Settings for a simulation: no store of the file's, runs beside the boat's folder of runs (``runs-sim``), not in it.

    A directory that the command line names is meant, unless a real boat's runs are in it (``check_run_dir``).
    """
    update: dict[str, object] = {"store": ""}
    if not any(item.partition("=")[0].strip() == "record.directory" for item in overrides):
        directory = Path(settings.record.directory)
        beside = directory.with_name(directory.name + _SUFFIX) if directory.name else directory / _SUFFIX.strip("-")
        update["record"] = settings.record.model_copy(update={"directory": str(beside)})
    return settings.model_copy(update=update)


def check_run_dir(run_dir: Path, runs: str) -> None:
    """Raise ConfigError for the directory of a real run, and for one among the runs (in ``runs``) of a boat that has sailed.

    A simulation among them would count when the oldest make room, and would pass for a voyage.
    """
    if _is_real(run_dir):
        raise ConfigError("--run-dir", [f"--run-dir {run_dir}: holds the run of a real boat; give another"])
    folder = run_dir.absolute().parent
    if folder == Path(runs).absolute() and any(_is_real(path.parent) for path in folder.glob("*/run.json")):
        told = f"{run_dir}: stands among the runs of a real boat; give another, such as {Path(runs).name}{_SUFFIX}/{run_dir.name}"
        raise ConfigError("--run-dir", [told])


def _is_real(run_dir: Path) -> bool:
    try:
        return kind_of_run(read_about(run_dir)) is WorldKind.REAL
    except (FileNotFoundError, AboutError):
        return False


def kind_of_run(about: dict[str, object]) -> WorldKind:
    """Which world a ``run.json`` is of; the first release says it only by the simulation's own settings."""
    if "world_kind" in about:
        return WorldKind.SIMULATED if about["world_kind"] == WorldKind.SIMULATED else WorldKind.REAL
    settings = about.get("settings")
    is_simulated = not isinstance(settings, dict) or "world" in settings
    return WorldKind.SIMULATED if is_simulated else WorldKind.REAL


def simulated_content(seed: int, start: StoreContent | None = None) -> StoreContent:
    """A simulation's store at its first start; the vessel's id comes from the seed, so that equal runs are equal."""
    vessel = f"{random.Random(f'vessel/{seed}').getrandbits(128):032x}"
    meta = {"world": WorldKind.SIMULATED.value, "vessel": vessel}
    start = start or StoreContent()
    return StoreContent(plans=start.plans, params=start.params, meta=meta)


def digest_of(content: StoreContent) -> str:
    """What a start of a simulation makes of its store: another memory makes another start, the same one the same."""
    rows = json.dumps(sorted(content.values.items())).encode()
    return blake2s(rows, digest_size=8).hexdigest()


def copied(settings: Settings) -> StoreContent:
    """The parameters and plans of the boat's store, which is not changed. Raises ConfigError when there is none."""
    path = Path(settings.store)
    if not settings.store or not path.is_file():
        raise ConfigError("--copy-store", [f"--copy-store: store = {settings.store!r}: there is none to copy"])
    try:
        content = look(path).content
    except Exception as error:
        raise ConfigError("--copy-store", [f"--copy-store: {path}: cannot be read: {error}"]) from None
    return StoreContent(plans={**content.old_plans, **content.plans}, params=content.params)


def simulated_store(path: Path | None, content: StoreContent, writer: Writer | None = None) -> AnyStore:
    """The store of a simulation: at ``path`` (made from ``content`` when it is not there), or in memory.

    Raises ConfigError for a store that is none of a simulation's.
    """
    if path is None:
        return MemoryStore(content)
    if path.exists():
        _refuse_foreign(path)
    else:
        rows = [StoredRow(section, key, body) for (section, key), body in rows_of(content).items() if section != "meta"]
        try:
            make_own_folder(path.parent)
            make_new(path, [*marks(WorldKind.SIMULATED, content.vessel or new_vessel_id()), *rows])
        except Exception:
            return Store(path, writer, world=WorldKind.SIMULATED)  # it tells why it cannot be written
    return Store(path, writer, world=WorldKind.SIMULATED)


def _refuse_foreign(path: Path) -> None:
    try:
        world = look(path).content.world
    except Exception:  # damaged, or another kind of file: whose it is nobody can say, and a store would move it aside
        told = f"{path}: no store that can be read; a simulation leaves it alone: give another file, or a name that is not there yet"
        raise ConfigError(str(path), [told]) from None
    if world != WorldKind.SIMULATED:
        whose = "of a real boat" if world else "without the mark of a simulation"
        raise ConfigError(str(path), [f"{path}: a store {whose}; a simulation leaves it alone: give another file"])
