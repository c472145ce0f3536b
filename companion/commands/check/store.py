"""What ``companion check`` says of the store: whose it is, what it holds, and where it overrules the configuration file."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from pathlib import Path

from ...facade import SettingsParams
from ...io.keeping.file import is_strange
from ...io.keeping.look import look
from ...io.keeping.mark import ForeignError, departure_refusal
from ...settings import Settings
from ...store_watch import overrides

Line = tuple[str, str]
"""What it is about ("store", "WARNING"), and the text."""


def _is_strange(path: Path) -> bool:
    return path.is_file() and is_strange(path)


def store_lines(settings: Settings) -> Iterator[Line]:
    """Look into the store without touching it."""
    if not settings.store:
        yield "store", "memory only: plans and parameters are lost at every stop"
        return
    path = Path(settings.store)
    if not path.exists():
        yield "store", f"{path}: not there yet"
        return
    try:
        found = look(path)
        content, told = found.as_used()
    except ForeignError as error:
        yield "store", str(path)
        yield "WARNING", f"store: {error}: run sets it aside and does not depart; put the boat's own in its place"
        return
    except (OSError, sqlite3.Error) as error:
        yield "store", str(path)
        does = "run leaves it alone and keeps nothing" if _is_strange(path) else "run rescues what it can"
        yield "WARNING", f"store: cannot be read ({error}); {does}"
        return
    plans = ", ".join(f"{kind.name.lower()} of {len(items)} items" for kind, items in content.plans.items() if items)
    held = [f"{len(content.params)} parameters", plans, f"{len(content.depth)} tiles of soundings"]
    yield "store", f"{path}: {', '.join(text for text in held if text)}"
    refusal = departure_refusal(content)
    warnings = [
        *found.texts,
        *told,
        *([refusal] if refusal else []),
        *overrides(SettingsParams(settings), content.params),
    ]
    yield from (("WARNING", text) for text in warnings)
