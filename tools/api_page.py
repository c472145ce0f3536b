"""docs/API.md: the two public faces, ``companion`` and ``sitl``, from their own signatures and docstrings."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from types import ModuleType
from typing import Any

from pydantic import BaseModel

import companion
import sitl

HEAD = """# The Python interface

What a program may import: these names, and what their objects show without an underscore. Everything else is inside and may change.
Angles are degrees where a name ends in `_deg`, else radians; all else is SI. The keys of settings: [CONFIGURATION.md](CONFIGURATION.md).
[first_loiter.py](examples/first_loiter.py) is a whole program.
"""


def page() -> str:
    """The page."""
    return "\n".join([HEAD, *_face(companion), "", *_face(sitl)]).rstrip("\n") + "\n"


def _face(module: ModuleType) -> Iterator[str]:
    yield f"## `{module.__name__}`"
    for name in sorted(module.__all__, key=str.lower):
        yield from ("", *_entry(name, getattr(module, name), "###"))


def _entry(name: str, what: Any, level: str) -> Iterator[str]:
    yield f"{level} `{name}{_signature(what)}`"
    yield from ("", inspect.getdoc(what) or "")
    if not inspect.isclass(what):
        return
    for inner, member in vars(what).items():
        if inner.startswith("_") or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        text = inspect.getdoc(member)
        if text:
            shown = inner if isinstance(member, property) else f"{inner}{_signature(member)}"
            yield from ("", f"* `{shown}`: {' '.join(text.split())}")


def _signature(what: Any) -> str:
    """Parameters as they are written; the types are in the source, which ships with them. A file's keys have a page of their own."""
    if inspect.isclass(what) and issubclass(what, BaseModel):
        return ""
    try:
        found = inspect.signature(what)
    except (TypeError, ValueError):
        return ""
    plain = [
        each.replace(annotation=inspect.Parameter.empty) for each in found.parameters.values() if each.name != "self"
    ]
    return str(found.replace(parameters=plain, return_annotation=inspect.Signature.empty))
