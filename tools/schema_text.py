"""Reads what settings models say of themselves: every key with type, default, range, unit and text.

The texts below plain fields are string literals in the source; they are read here, with the syntax tree, because reading
them in the vessel's process would cost start-up time.
"""

from __future__ import annotations

import ast
import enum
import inspect
import textwrap
import types
import typing
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import annotated_types
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from companion.core.config import Param, ParamGroup


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a configuration."""

    path: str
    kind: str
    default: str
    limits: str
    unit: str
    text: str
    parameter: str


def texts_of(model: type[BaseModel]) -> dict[str, str]:
    """The string literals below a model's fields, its bases' included."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if not (isinstance(base, type) and issubclass(base, BaseModel)) or base is BaseModel:
            continue
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(base)))
        except (OSError, TypeError):
            continue
        body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
        for field, after in pairwise(body):
            if (
                isinstance(field, ast.AnnAssign)
                and isinstance(field.target, ast.Name)
                and isinstance(after, ast.Expr)
                and isinstance(after.value, ast.Constant)
                and isinstance(after.value.value, str)
            ):
                found[field.target.id] = " ".join(after.value.value.split())
    return found


def keys(
    model: type[BaseModel], prefix: str = "", parameters: str = "", *, table: BaseModel | None = None
) -> Iterator[Key]:
    """Every key below a model, in order of declaration; lists of tables count as one table. ``parameters``: their prefix.

    ``table``: what stands there when the file has none, from which a key gets its default that each table has of its own.
    """
    texts = texts_of(model)
    for name, field in model.model_fields.items():
        path = f"{prefix}{name}"
        inner = inner_model(field.annotation)
        if inner is not None:
            named = ".NAME" if typing.get_origin(field.annotation) is dict else ""
            group = next((item.prefix for item in field.metadata if isinstance(item, ParamGroup)), "")
            yield from keys(
                inner, f"{path}{named}.", group, table=field.default if isinstance(field.default, BaseModel) else None
            )
            continue
        mark = next((item for item in field.metadata if isinstance(item, Param)), None)
        yield Key(
            path=path,
            kind=_names_in_range(field) or kind_of(field.annotation),
            default=default_of(field, getattr(table, name, None)),
            limits=limits_of(field),
            unit=mark.unit if mark else "",
            text=(field.description or texts.get(name, "")).rstrip("."),
            parameter=parameters + mark.name if mark else "",
        )


def inner_model(annotation: Any) -> type[BaseModel] | None:
    """The model inside an annotation: itself, in a tuple, or optional."""
    for found in (annotation, *typing.get_args(annotation)):
        if isinstance(found, type) and issubclass(found, BaseModel):
            return found
    return None


def _names_in_range(field: FieldInfo) -> str:
    """The names that a value with names may have; empty for any other."""
    kinds = [field.annotation, *typing.get_args(field.annotation)]
    found = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, enum.Enum)), None)
    if found is None:
        return ""
    low = next((item.ge for item in field.metadata if isinstance(item, annotated_types.Ge)), None)
    high = next((item.le for item in field.metadata if isinstance(item, annotated_types.Le)), None)
    fits = [item for item in found if (low is None or item.value >= low) and (high is None or item.value <= high)]
    optional = ", optional" if type(None) in kinds else ""
    return ", ".join(f"`{item.name.lower()}`" for item in fits) + optional


def kind_of(annotation: Any) -> str:
    """A type in a reader's words."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return kind_of(typing.get_args(annotation)[0])
    if origin is typing.Literal:
        return ", ".join(f"`{value!r}`".replace("'", '"') for value in typing.get_args(annotation))
    if origin in (typing.Union, types.UnionType):
        parts = [kind_of(part) for part in typing.get_args(annotation) if part is not type(None)]
        return f"{' or '.join(parts)}, optional"
    if origin in (tuple, list, frozenset, dict):
        return "list" if origin is not dict else "table"
    if isinstance(annotation, type) and issubclass(annotation, enum.Enum):
        return ", ".join(f"`{item.name.lower()}`" for item in annotation)
    return {"float": "number", "int": "whole number", "bool": "true or false", "str": "text", "Path": "path"}.get(
        getattr(annotation, "__name__", ""), str(annotation)
    )


def default_of(field: FieldInfo, own: object = None) -> str:
    """The default as it would stand in TOML. ``own``: the one of this table alone."""
    if field.is_required() and own is None:
        return "*required*"
    value = own if field.is_required() else field.get_default(call_default_factory=True)
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, enum.Enum):
        return value.name.lower()
    return (
        f'`"{value}"`'.replace("\n", "\\n").replace("\r", "\\r").replace("|", "\\|")
        if isinstance(value, str)
        else str(value)
    )


def limits_of(field: FieldInfo) -> str:
    """The range, as 'low…high'."""
    low = next((item.ge for item in field.metadata if isinstance(item, annotated_types.Ge)), None)
    high = next((item.le for item in field.metadata if isinstance(item, annotated_types.Le)), None)
    above = next((item.gt for item in field.metadata if isinstance(item, annotated_types.Gt)), None)
    if low is None and high is None:
        return "" if above is None else f"> {above}"
    return f"{'' if low is None else f'{low}'}…{'' if high is None else f'{high}'}"
