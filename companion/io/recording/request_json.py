"""Requests of the vessel's own people (a start, a scenario's command) as JSON, for the recorded inputs.

Any frozen dataclass or enum of the vocabulary goes through unchanged; a name that the vocabulary does not have is
refused, so that reading a recording runs nothing.
"""

from __future__ import annotations

import dataclasses
import enum
import json
from typing import Any, Final, cast

from mavlink_bridge.language import messages as imc, requests
from mavlink_bridge.language.figures import figure_of
from mavlink_bridge.language.requests import RequestBody
from mavlink_bridge.language.stations import Station
from mavlink_bridge.mavlink.wire.cmd import Cmd

_KNOWN: Final[dict[str, type]] = {"Cmd": Cmd} | {
    name: found
    for module in (imc, requests)
    for name, found in vars(module).items()
    if isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, enum.Enum))
}


class NoRequestError(ValueError):
    """A text that is no request, or one that only another version knows."""


def dumps(body: RequestBody, station: Station | None = None) -> str:
    """Write a request body, with who stands by and asks for it."""
    return json.dumps(_plain(body) if station is None else {"asked": _plain(body), "by": dataclasses.asdict(station)})


def loads(text: str) -> tuple[RequestBody, Station | None]:
    """Read a request body and who asked for it. Raises NoRequestError for anything that is none."""
    try:
        data = json.loads(text)
        if isinstance(data, dict) and "asked" in data:
            return cast(RequestBody, _object(data["asked"])), Station(**data["by"])
        return cast(RequestBody, _object(data)), None
    except (KeyError, TypeError, ValueError) as error:
        raise NoRequestError(f"not a request: {error}") from error


def _plain(value: Any) -> Any:
    if isinstance(value, enum.Enum):
        if type(value).__name__ not in _KNOWN and isinstance(value, int):
            return int(value)  # a number by a name that nobody could read again
        return {"enum": type(value).__name__, "name": value.name}
    if dataclasses.is_dataclass(value):
        fields = {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return {"class": type(value).__name__, "fields": fields}
    if isinstance(value, bytes):
        return {"bytes": value.hex()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value


def _object(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(_object(item) for item in value)
    if not isinstance(value, dict):
        return value
    if "bytes" in value:
        return bytes.fromhex(value["bytes"])
    if value.get("enum") == "LoiterKind":
        return _KINDS_OF_THE_FIRST_RELEASE[value["name"]]
    if "enum" in value:
        return _KNOWN[value["enum"]][value["name"]]  # type: ignore[index]
    fields = {name: _object(item) for name, item in value["fields"].items()}
    if value["class"] in ("Loiter", "Orbit") and "kind" in fields:
        fields = _loiter_of_the_first_release(fields)
    return _KNOWN[value["class"]](**fields)


_KINDS_OF_THE_FIRST_RELEASE: Final = {
    "CIRCULAR": "circular",
    "RACETRACK": "racetrack",
    "FIGURE_EIGHT": "figure-eight",
    "HOVER": "hover",
}
"""An enum's names then, and the figures' now."""


def _loiter_of_the_first_release(fields: dict[str, Any]) -> dict[str, Any]:
    """A loiter and an orbit had the fields of all figures then."""
    named = {name: fields.pop(name) for name in ("radius_m", "length_m", "bearing_rad", "direction")}
    return {"figure": figure_of(fields.pop("kind"), **named), **fields}
