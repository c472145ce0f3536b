"""The parameter table: every setting declared with ``param`` anywhere in the settings, found by walking the models.

One declaration drives the TOML key, PARAM_*, the documentation and the validation. Values are REAL32 on the wire, so
comparisons are made after rounding to float32.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar, get_args

import annotated_types
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ..core.config import Param, ParamGroup

Model = TypeVar("Model", bound=BaseModel)
_ALONE: Final = ParamGroup("", "")


@dataclass(frozen=True, slots=True)
class ParamEntry:
    """One parameter: where it lives and what it may be."""

    param: Param
    key: str
    """TOML key, e.g. 'depth.min_altitude_m'."""
    path: tuple[str, ...]
    text: str
    default: float | None
    minimum: float | None
    maximum: float | None
    kind: type
    """float, int or bool."""


def float32(value: float) -> float:
    """Round to the REAL32 that crosses the wire."""
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def entries(model: type[BaseModel], path: tuple[str, ...] = (), group: ParamGroup = _ALONE) -> Iterator[ParamEntry]:
    """Yield every parameter of a settings model, in order of declaration."""
    for name, field in model.model_fields.items():
        here = (*path, name)
        mark = next((item for item in field.metadata if isinstance(item, Param)), None)
        below = next((item for item in field.metadata if isinstance(item, ParamGroup)), None)
        if mark is not None:
            yield _entry(mark, field, here, group)
        elif below is not None:
            (inner,) = (kind for kind in get_args(field.annotation) if kind is not type(None))
            yield from entries(inner, here, below)
        elif isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from entries(field.annotation, here)


def present(settings: BaseModel) -> Iterator[ParamEntry]:
    """Yield the parameters that these settings have: those of a group that is not given are not there."""
    for entry in entries(type(settings)):
        model: Any = settings
        for name in entry.path[:-1]:
            model = getattr(model, name)
            if model is None:
                break
        else:
            yield entry


def _entry(mark: Param, field: FieldInfo, path: tuple[str, ...], group: ParamGroup) -> ParamEntry:
    low = next((item.ge for item in field.metadata if isinstance(item, annotated_types.Ge)), None)
    high = next((item.le for item in field.metadata if isinstance(item, annotated_types.Le)), None)
    kind = _kind(field.annotation)
    default = None if field.is_required() or field.default is None else float(field.default)
    bounds: tuple[Any, Any] = (0.0, 1.0) if kind is bool else (low, high)
    text = field.description or ""
    return ParamEntry(
        param=replace(mark, name=group.prefix + mark.name),
        key=".".join(path),
        path=path,
        text=f"{group.text}: {text}" if group.text else text,
        default=default,
        minimum=bounds[0],
        maximum=bounds[1],
        kind=kind,
    )


def _kind(annotation: Any) -> type:
    """float, int or bool. A choice that has numbers is an int: there is nothing between two of them."""
    is_whole = isinstance(annotation, type) and issubclass(annotation, int)
    return bool if annotation is bool else int if is_whole else float


def read(settings: BaseModel, entry: ParamEntry) -> float:
    """Return a parameter's value as it crosses the wire; NaN for a setting that is not given."""
    value: Any = settings
    for name in entry.path:
        value = getattr(value, name)
    return float("nan") if value is None else float32(float(value))


def write(settings: Model, entry: ParamEntry, value: float) -> Model:
    """Return settings with one parameter changed; one of a group that is not given is refused.

    Raises ValueError with one plain sentence when the value is refused; the old settings are untouched.
    """
    if value != value or value in (float("inf"), float("-inf")):
        raise ValueError(f"{entry.param.name}: not a finite number")
    if entry.kind is not float and value != int(value):
        raise ValueError(f"{entry.param.name} = {value:g}: a whole number is needed")
    exact: float | bool | int = entry.kind(value)
    for limit, below in ((entry.minimum, True), (entry.maximum, False)):
        if limit is not None and float32(value) == float32(limit):
            exact = entry.kind(limit)
        elif limit is not None and (value < limit) == below and value != limit:
            side = "at least" if below else "at most"
            raise ValueError(f"{entry.param.name} = {value:g}: must be {side} {limit:g}")
    try:
        return _replace(settings, entry.path, exact)
    except ValidationError as error:
        raise ValueError(f"{entry.param.name} = {value:g}: {error.errors()[0]['msg']}") from None


def _replace(model: Model, path: tuple[str, ...], value: object) -> Model:
    name, rest = path[0], path[1:]
    if rest and getattr(model, name) is None:
        raise ValueError(f"{rest[-1]}: the configuration has no {name}")
    data = {key: getattr(model, key) for key in type(model).model_fields}
    data[name] = _replace(getattr(model, name), rest, value) if rest else value
    return type(model).model_validate(data)
