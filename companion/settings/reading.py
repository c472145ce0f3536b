"""How a file of settings is read, whichever part of the program it is for: TOML, then ``--set key=value``, then judged whole.

Every mistake is told at once, with its key, its value and the mend. Knows no part's settings, so that a process that has few of its
own need not load the vessel's.
"""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Callable, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ValidationError

from .device import no_device
from .lines import Key, lines_of
from .moved import told as moved_to
from .told import NO_SUCH_KEY, key_of, line_of_named, printed, told, wrong_kinds

Model = TypeVar("Model", bound=BaseModel)

_ROUNDS: Final = 6
"""How often what is wrong is left out and the rest judged again: as deep as tables lie in tables, and one more."""


class ConfigError(Exception):
    """Every mistake of a configuration, one line each: key, value, mend."""

    def __init__(self, source: str, mistakes: Sequence[str]) -> None:
        super().__init__(f"{source}: " + "; ".join(mistakes))
        self.source = source
        self.mistakes = tuple(mistakes)


def read_model(
    path: Path | None,
    overrides: Sequence[str],
    model: type[Model],
    *,
    further: Callable[[Model], list[str]] = lambda settings: [],
    other_kind: Callable[[dict[str, Any]], str] = lambda data: "",
) -> Model:
    """Read a TOML file (None: defaults only), apply ``key=value`` overrides and validate.

    ``further`` finds what is wrong with settings of which each value is right. ``other_kind`` says, in words, that a file is one of
    another kind; then nothing else is said of it. Raises ConfigError with every mistake.
    """
    source = str(path) if path else "defaults"
    data, lines = _read(path) if path else ({}, {})
    if mistaken := other_kind(data):
        raise ConfigError(source, [mistaken])
    mistakes = [mistake for item in overrides if (mistake := override(data, item))]
    for item in overrides:
        lines[key_of(item)] = 0  # what was given on the command line stands in no line
    settings, wrong = _judged(data, model, further)
    if mistakes or wrong or settings is None:
        raise ConfigError(source, [*mistakes, *told(wrong, lines, data, model)])
    return settings


def _judged(
    data: dict[str, Any], model: type[Model], further: Callable[[Model], list[str]]
) -> tuple[Model | None, list[str]]:
    """Return the settings, and every mistake in one go: behind what validation refuses its defaults stand, and are not judged."""
    rest = copy.deepcopy(data)
    wrong: list[str] = []
    refused: list[Key] = []

    def refuse(key: Key, mistake: str) -> None:
        if not any(key[: len(known)] == known for known in refused):
            wrong.extend(mistake.split("\n"))
            refused.append(key)

    for key, value, wanted in list(wrong_kinds(model, rest)):
        refuse(key, f"{'.'.join(map(str, key))} = {_shown(value)}: {wanted}")
        _leave_out(rest, key, stand_in=printed(value))
    settings: Model | None = None
    empty: list[Key] = []
    for _ in range(_ROUNDS):
        try:
            settings = model.model_validate(rest)
            break
        except ValidationError as error:
            for item in error.errors():
                key = item["loc"]
                if key in refused or key in empty:  # nothing can stand there: without the table around it
                    _leave_out(rest, key[:-1])
                    continue
                if item["type"] != "missing" or not any(known[: len(key)] == key for known in refused):
                    refuse(key, explain(item))
                elif item["type"] == "missing":
                    empty.append(key)
                _leave_out(rest, key, stand_in="" if item["type"] == "missing" else None)
    if settings is not None:
        wrong += [mistake for mistake in further(settings) if not _is_about(key_of(mistake), refused)]
    return settings, wrong


def _is_about(key: Key, refused: Sequence[Key]) -> bool:
    """Whether a mistake is about a value that was refused already, or about an item of a list that lacks more than its name."""
    heads = [
        known[:2] if known[1:2] and isinstance(known[1], int) and known[-1] != "name" else known for known in refused
    ]
    return any(key[: len(head)] == head for head in heads)


def _leave_out(data: Any, where: Sequence[int | str], stand_in: Any = None) -> None:
    """Take a value out of configuration data, or put something in its place. In a list an empty table takes it: places count."""
    for step in where[:-1]:
        try:
            data = data[step]
        except (LookupError, TypeError):
            return
    if isinstance(data, dict) and where:
        data.pop(where[-1], None)
        if stand_in is not None:
            data[str(where[-1])] = stand_in
    elif isinstance(data, list) and where and isinstance(where[-1], int) and where[-1] < len(data):
        data[where[-1]] = {}


def _read(path: Path) -> tuple[dict[str, Any], dict[Key, int]]:
    """The file's content, and the line of each of its keys."""
    try:
        text = no_device(path).read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise ConfigError(str(path), ["no such file"]) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(str(path), [unreadable(error)]) from None
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [_no_toml(error, text)]) from None
    folder = str(path.resolve().parent)
    return {key: _placed(value, folder) for key, value in data.items()}, lines_of(text)


def with_lines(path: Path, texts: Sequence[str]) -> list[str]:
    """Sentences about a file that can be used, each with the line of the key that it begins with, where the file has one."""
    data, lines = _read(path)
    found = [(text, line_of_named(text, lines, data)) for text in texts]
    return [f"{text} (line {line})" if line else text for text, line in found]


_AT: Final = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
_OF_TOML: Final = {
    "Cannot overwrite a value": "this key stands above already; leave out one of the two",
    "Cannot declare": "this section stands above already; write all its keys below one header",
    "Illegal character '\\n'": "the text has no second quotation mark in its line; add it",
    "Invalid value": "is no value; a text stands in quotation marks, a number has a decimal point",
    "Invalid statement": "is no TOML; write key = value, or [section]",
    "Expected '=' after a key": "is no TOML; write key = value",
}
"""What the reader of TOML says, and what a person should do."""


def _no_toml(error: Exception, text: str) -> str:
    """Why a text is no TOML: the line, what stands there, and the mend. What comes behind it cannot be read."""
    said = str(error)
    at = _AT.search(said)
    what = said[: at.start()] if at else said
    mend = next((mend for start, mend in _OF_TOML.items() if what.startswith(start)), f"is no TOML: {what}")
    if not at or not at[1]:
        return f"not valid TOML at its end: {what}"
    line = text.splitlines()[int(at[1]) - 1].strip()
    return f"line {at[1]}: not valid TOML: {line!r}: {mend}"


def unreadable(error: Exception) -> str:
    """Why a file of text cannot be read, without the computer's numbers."""
    if isinstance(error, UnicodeDecodeError):
        return f"holds no UTF-8 text: byte {error.object[error.start]:#04x} at {error.start}; save it as UTF-8"
    return f"cannot be read: {getattr(error, 'strerror', None) or error}"


def _placed(value: Any, folder: str) -> Any:
    """Return the value with CONFIG_DIR in every text replaced by the file's folder."""
    if isinstance(value, str):
        return value.replace("CONFIG_DIR", folder)
    if isinstance(value, dict):
        return {key: _placed(item, folder) for key, item in value.items()}
    return [_placed(item, folder) for item in value] if isinstance(value, list) else value


def override(data: dict[str, Any], item: str) -> str:
    """Put one ``key=value`` into configuration data; return the mistake, or nothing."""
    key, equals, text = item.partition("=")
    if not equals or not key.strip():
        return f"--set {item}: write it as key=value, e.g. --set depth.enabled=false"
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text
    *tables, last = key.strip().split(".")
    place: Any = data
    for depth, table in enumerate(tables):
        if isinstance(place, dict):
            place.setdefault(table, {})
        problem = _no_place(place, table, ".".join(tables[:depth]))
        if problem:
            return f"--set {item}: {problem}"
        place = place[table if isinstance(place, dict) else int(table)]
    problem = _no_place(place, last, ".".join(tables))
    if not problem:
        place[last if isinstance(place, dict) else int(last)] = value
    return problem and f"--set {item}: {problem}"


def _no_place(place: Any, name: str, where: str) -> str:
    """Why configuration data has no place of a name; nothing when it has, or can get, one."""
    if isinstance(place, dict):
        return ""
    if not isinstance(place, list):
        return f"{where} is a value, not a table; leave out .{name}"
    if not name.isdecimal() or int(name) >= len(place):
        return f"{where} has {len(place)} entries, counted from 0; {name} is none of them: add it to the file"
    return ""


_WANTED: Final = {
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type"), "must be a table"),
    **dict.fromkeys(("tuple_type", "list_type"), "must be a list"),
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "must be a whole number"),
    **dict.fromkeys(("float_type", "float_parsing", "finite_number"), "must be a number"),
    **dict.fromkeys(("bool_type", "bool_parsing"), "must be true or false"),
    "string_type": "must be a text, in quotes",
    "path_type": "must be a path, in quotes",
}
"""What should stand where a value of another kind stands, by pydantic's name of the error."""


_OF_A_PART: Final = re.compile(r"\w+(\.\w+)+(:| =)")
"""A table that names the key inside it: each of its lines is a mistake of its own."""


def explain(error: Any) -> str:
    """Turn one pydantic error into 'key = value: what to do'."""
    key = ".".join(str(part) for part in error["loc"]) or "file"
    kind, message = error["type"], error["msg"].removeprefix("Value error, ")
    if kind == "extra_forbidden":
        moved = moved_to(key, error.get("input"))
        return f"{key} = {_shown(error.get('input'))}: {moved}" if moved else f"{key}: {NO_SUCH_KEY}"
    if kind == "missing":
        return f"{key}: missing; add it"
    value = error.get("input")
    limits = error.get("ctx", {})
    if isinstance(value, dict) and _OF_A_PART.match(message):
        return "\n".join(f"{key}.{part}" for part in message.split("\n"))
    wanted = _WANTED.get(kind) or _in_names(value, limits) or _in_range(kind, limits)
    said = wanted or (message if message[1:2].isupper() else f"{message[:1].lower()}{message[1:]}")
    shown = (
        "" if isinstance(value, dict | list) and not wanted else f" = {_shown(value)}"
    )  # what is wrong in it is told behind
    return f"{key}{shown}: {said}"


def _shown(value: Any) -> str:
    """A value as it would stand in the file; of what is long only its kind."""
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return repr(value)
    return {dict: "a table", list: "a list", tuple: "a list", type(None): "nothing"}.get(type(value), str(value))


_LIMITS: Final = {
    "greater_than_equal": ("ge", "at least"),
    "less_than_equal": ("le", "at most"),
    "greater_than": ("gt", "above"),
    "less_than": ("lt", "below"),
    "literal_error": ("expected", "one of"),
    "enum": ("expected", "one of"),
    "string_too_long": ("max_length", "no longer, in characters, than"),
}


def _in_range(kind: str, limits: dict[str, Any]) -> str:
    """The range of a value in plain words."""
    limit, words = _LIMITS.get(kind, ("", ""))
    return f"must be {words} {limits[limit]}" if limit in limits else ""


def _in_names(value: Any, limits: dict[str, Any]) -> str:
    """The range of a value that has a name, in names."""
    if isinstance(value, Enum):
        for limit, words in (("ge", "at least"), ("le", "at most")):
            if limit in limits:
                return f"must be {words} {type(value)(limits[limit]).name.lower()}"
    return ""
