"""How a mistake in a configuration is told: its line, the name of a list's item, and the key that was probably meant."""

from __future__ import annotations

import difflib
import re
import types
import typing
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from pydantic import BaseModel

from .lines import Key

NO_SUCH_KEY: Final = "no such key; remove it or check the spelling"
_KEY: Final = re.compile(r"[A-Za-z_][\w-]*(?:\.[\w-]+)*")
_ITEM: Final = re.compile(r"\b(sensors|endpoints)\.(\d+)\b(?: \([^)]*\))?(\.)?")
_NAMED: Final = re.compile(r"(sensors|endpoints) '([^']*)' ?([\w.]*)")
_SWITCHES: Final = ("yes", "no", "true", "false", "on", "off")
_NUMBER: Final = re.compile(r"[-+]?\d+([.,]\d+)?")
_ALIKE: Final = 0.72
"""How like a spelling must be to be offered (difflib's ratio): system_id for sytem_id, not depth for deck."""


def told(
    mistakes: Sequence[str], lines: Mapping[Key, int], data: Mapping[str, Any], model: type[BaseModel]
) -> list[str]:
    """Return the mistakes as a person reads them, each once, in the order of the file; what has no line comes last."""
    rows = []
    for mistake in dict.fromkeys(mistakes):
        key = key_of(mistake)
        line = _line(key, lines)
        text = mistake
        if mistake.endswith(NO_SUCH_KEY):
            text = mistake.removesuffix(NO_SUCH_KEY) + f"no such key; {meant(model, key)}"
        elif mistake.endswith("must be a list"):
            text = mistake.removesuffix("must be a list") + _as_list(model, key)
        elif mistake.endswith("must be a table"):
            text = (
                mistake.removesuffix("must be a table")
                + f"must be a table: [{'.'.join(map(str, key))}], with keys below it"
            )
        rows.append((line or 10**9, f"line {line}: " if line else "", named(text, data)))
    return [place + text for _, place, text in sorted(rows, key=lambda row: row[0])]


def _as_list(model: type[BaseModel], key: Key) -> str:
    """How a list is written: of tables, or of values."""
    if fields_at(model, key):
        return f"write [[{key[-1]}]] with two brackets: there may be several"
    return f"must be a list, in brackets: {key[-1]} = [...]"


def key_of(mistake: str) -> Key:
    """The key that a mistake begins with."""
    found = _KEY.match(mistake)
    return tuple(int(part) if part.isdigit() else part for part in found[0].split(".")) if found else ()


def line_of_named(text: str, lines: Mapping[Key, int], data: Mapping[str, Any]) -> int | None:
    """The line that a sentence is about which begins with a key; items of a list may have their names in it."""
    found = _NAMED.match(text)
    if found is None:
        return _line(key_of(text), lines)
    items = data.get(found[1], [])
    here = (number for number, item in enumerate(items) if isinstance(item, dict) and item.get("name") == found[2])
    number = next(here, None)
    return None if number is None else _line((found[1], number, *filter(None, found[3].split("."))), lines)


def _line(key: Key, lines: Mapping[Key, int]) -> int | None:
    """The line of a key, or of the innermost table around one that is missing."""
    for length in range(len(key), 0, -1):
        if key[:length] in lines:
            return lines[key[:length]]
    return None


def named(text: str, data: Mapping[str, Any]) -> str:
    """Items of a list by their names instead of their numbers."""

    def name(found: re.Match[str]) -> str:
        items, number = data.get(found[1]), int(found[2])
        item = items[number] if isinstance(items, list) and number < len(items) else None
        shown = item.get("name") if isinstance(item, dict) else None
        label = f"{found[1]} {shown!r}" if isinstance(shown, str) and shown else f"{found[1]} number {number + 1}"
        return f"{label} " if found[3] else label

    return _ITEM.sub(name, text)


# ---- the key that was meant -----------------------------------------------------------------------------------------


def meant(model: type[BaseModel], key: Key) -> str:
    """What to do about a key that there is not."""
    if not key:
        return "remove it"
    name = str(key[-1])
    beside = fields_at(model, key[:-1])
    everywhere = list(_leaves(model))
    homes = [way for way in everywhere if way[-1] == _plain(name)]
    if _plain(name) in beside:
        return f"did you mean {_plain(name)}?"
    if homes:
        return "it belongs in " + " or ".join(_table(way) for way in homes[:3])
    similar = difflib.get_close_matches(_plain(name), beside, 1, _ALIKE)
    if similar:
        return f"did you mean {similar[0]}?"
    similar = difflib.get_close_matches(_plain(name), [way[-1] for way in everywhere], 1, _ALIKE)
    if similar:
        way = next(way for way in everywhere if way[-1] == similar[0])
        return f"did you mean {similar[0]} in {_table(way)}?"
    return "remove it or look for the right one in docs/CONFIGURATION.md"


def _plain(name: str) -> str:
    return name.lower().replace("-", "_")


def _table(way: Sequence[str]) -> str:
    """Where a key stands, as the file writes it."""
    head = way[:-1]
    if not head:
        return "the top of the file"
    return f"[[{head[0]}]]" if len(head) == 1 and head[0] in ("sensors", "endpoints") else f"[{'.'.join(head)}]"


def fields_at(model: type[BaseModel], key: Key) -> list[str]:
    """Names of the keys that a table may have; none for what is no table."""
    place: type[BaseModel] | None = model
    for part in key:
        if isinstance(part, int):
            continue
        field = None if place is None else place.model_fields.get(str(part))
        place = None if field is None else inner_model(field.annotation)
    return [] if place is None else list(place.model_fields)


def _leaves(model: type[BaseModel], way: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    for name, field in model.model_fields.items():
        inner = inner_model(field.annotation)
        yield (*way, name)
        if inner is not None:
            yield from _leaves(inner, (*way, name))


def inner_model(annotation: Any) -> type[BaseModel] | None:
    """The model of a table, or of each item of a list of tables."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(inner_model, typing.get_args(annotation))), None)


# ---- kinds of values ------------------------------------------------------------------------------------------------


def wrong_kinds(model: type[BaseModel], data: Any, way: Key = ()) -> Iterator[tuple[Key, Any, str]]:
    """Yield (key, value, what it must be) of values that validation would turn into another kind in silence.

    A text is no switch and no number: "no" for false, or "0,5" cut to nothing, is a person's slip, not a setting. Nor does a name or
    an address hold what no keyboard types: no file is called so.
    """
    if not isinstance(data, dict):
        return
    for name, value in data.items():
        field = model.model_fields.get(name)
        if field is None:
            continue
        inner, here = inner_model(field.annotation), (*way, name)
        if inner is not None:
            items = enumerate(value) if isinstance(value, list) else [(None, value)]
            for number, item in items:
                yield from wrong_kinds(inner, item, here if number is None else (*here, number))
        elif wanted := _wanted(field.annotation, value) or _unprinted(field.annotation, value):
            yield here, value, wanted


def _unprinted(annotation: Any, value: Any) -> str:
    """That a text holds control characters; nothing where one of a few given words must stand, which is judged by itself."""
    if typing.get_origin(annotation) is typing.Literal:
        return ""
    found = {char for text in _texts(value) for char in text if _is_control(char)}
    return f"holds {' and '.join(map(ascii, sorted(found)))}, which no screen shows; leave it out" if found else ""


def printed(value: Any) -> Any:
    """A text, or a list of them, without its control characters: what stands in for it while the rest is judged. None for what has none."""
    if not any(_is_control(char) for text in _texts(value) for char in text):
        return None
    if isinstance(value, list):
        return [printed(item) or item for item in value]
    return "".join(char for char in value if not _is_control(char))


def _texts(value: Any) -> list[str]:
    return [item for item in (value if isinstance(value, list) else [value]) if isinstance(item, str)]


def _is_control(char: str) -> bool:
    return unicodedata.category(char) == "Cc"


def _wanted(annotation: Any, value: Any) -> str:
    """What a plain value must be and is not; nothing for what validation itself judges."""
    union = typing.get_origin(annotation) in (typing.Union, types.UnionType)
    kinds = set(typing.get_args(annotation)) - {type(None)} if union else {annotation}
    if kinds == {bool}:
        wanted = "" if isinstance(value, bool) else "must be true or false"
    elif kinds <= {int, float} and isinstance(value, str | bool):
        wanted = "must be a whole number" if kinds == {int} else "must be a number"
    else:
        wanted = ""
    quoted = isinstance(value, str) and (value.lower() in _SWITCHES or _NUMBER.fullmatch(value.strip()) is not None)
    return f"{wanted}, without quotes" if wanted and quoted else wanted
