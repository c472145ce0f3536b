"""How a part of the vessel declares its settings: one frozen model per part, each field said once.

A field made by ``param`` is also a MAVLink parameter; TOML keys, PARAM_* messages, documentation and validation all
derive from the same declaration. ``settings.py`` only puts the models together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo


class Config(BaseModel):
    """Base of every settings model: frozen, unknown keys refused, finite numbers only."""

    # Texts below fields are read by tools/generate_docs.py; reading them here would cost a fifth of the start-up.
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, slots=True)
class Param:
    """What makes a setting a MAVLink parameter."""

    name: str
    """At most 16 characters, upper case."""
    unit: str = ""
    live: bool = True
    """False: takes effect at the next start."""
    seed: str = ""
    """The DUNE task parameter it re-does, e.g. 'MinAltitude: Minimum Acceptable Altitude'."""


@dataclass(frozen=True, slots=True)
class ParamGroup:
    """What the parameters of a whole model begin with, where one model serves several times."""

    prefix: str
    text: str


def param_group(prefix: str, text: str) -> Any:
    """Declare an optional model whose parameters are ``prefix`` and their own names; without it there are none of them."""
    field: Any = Field(None)
    assert isinstance(field, FieldInfo)
    field.metadata.append(ParamGroup(prefix, text))
    return field


def param(
    default: Any,
    name: str,
    text: str,
    *,
    unit: str = "",
    ge: float | None = None,
    le: float | None = None,
    live: bool = True,
    seed: str = "",
) -> Any:
    """Declare a field that is also the MAVLink parameter ``name`` (default, range, unit, text: once).

    Use inside a ``Config``: ``min_altitude_m: float = param(4.0, "DEPTH_MIN", "...", unit="m", ge=0, le=100)``.
    ``...`` as default makes the key required. Values are numbers or booleans; on the wire REAL32.
    """
    if len(name) > 16 or not name.isascii() or name != name.upper():
        raise ValueError(f"parameter name {name!r}: at most 16 upper-case ASCII characters")
    extra: dict[str, Any] = {"unit": unit, "param": name}
    field: Any = Field(default, description=text, ge=ge, le=le, json_schema_extra=extra)
    assert isinstance(field, FieldInfo)
    field.metadata.append(Param(name=name, unit=unit, live=live, seed=seed))
    return field
