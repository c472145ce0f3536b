"""``@value``: the frozen dataclass of the hot path, frozen for the type checker and cheap to make.

``dataclass(frozen=True)`` guards each object at run time, and pays for it with a call for each field of each object: at 300
fields a tick a seventh of the whole. A value is guarded before the run instead: mypy refuses every assignment to its
fields. What must stay guarded at run time as well, such as ``ActuatorOutput``, remains a frozen dataclass.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar, dataclass_transform

Made = TypeVar("Made")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def value(cls: type[Made]) -> type[Made]:
    """Make a dataclass with slots, compared and hashed by its fields, that only the type checker protects from change."""
    return dataclass(slots=True, unsafe_hash=True)(cls)
