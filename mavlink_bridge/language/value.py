"""``@value``: the frozen dataclass of the hot path, frozen for the type checker and cheap to make.

``dataclass(frozen=True)`` guards each object at run time, and pays for it with a call for each field of each object: at 300
fields a tick a seventh of the whole. A value is guarded before the run instead: mypy refuses every assignment to its
fields. What must stay guarded at run time as well, such as ``ActuatorOutput``, remains a frozen dataclass. Values share one
repr, comparison and hash instead of having them written and compiled for each class at every start.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform

Made = TypeVar("Made")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def value(cls: type[Made]) -> type[Made]:
    """Make a dataclass with slots, compared and hashed by its fields, that only the type checker protects from change."""
    return _compared(dataclass(slots=True, eq=False, repr=False)(cls))


def _compared(cls: type[Made]) -> type[Made]:
    """Give a dataclass what ``dataclass`` itself would write anew for it."""
    made: Any = cls
    made._content = _content_of(tuple(each.name for each in fields(made)))
    made.__repr__, made.__eq__, made.__hash__ = _repr, _eq, _hash
    return cls


def _content_of(names: tuple[str, ...]) -> Callable[[Any], Any]:
    return attrgetter(*names) if names else type


def _repr(self: Any) -> str:
    content = ", ".join(f"{each.name}={getattr(self, each.name)!r}" for each in fields(self))
    return f"{type(self).__qualname__}({content})"


def _eq(self: Any, other: Any) -> Any:
    if other.__class__ is not self.__class__:
        return NotImplemented
    content: Callable[[Any], Any] = self._content
    return content(self) == content(other)


def _hash(self: Any) -> int:
    return hash(self._content(self))
