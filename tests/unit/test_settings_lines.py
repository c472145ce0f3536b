"""The line of every key, against tomllib's reading of the same text."""

from __future__ import annotations

import tomllib

import pytest

import config
from companion.settings.lines import lines_of

TEXT = '''# a file
vessel = "otter" # [not a table]
"odd key" = 'x = [1'

[system]
name = """two
lines = 3
"""
tick_hz = 20

[[sensors]]
name = "a"
nmea = { sentences = "GGA", relay = true }
[[sensors]]
name = "b"
[sensors.nmea]
sentences = "#"
[depth]
input.keel_depth_m = 1
list = [
  1,  # one
  { a = 1, b = 2 },
]
[record]
'''


def keys(data, way=()):
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*way, key)
        yield from keys(value, (*way, key))


def test_every_key_has_its_line():
    found = lines_of(TEXT)
    assert set(keys(tomllib.loads(TEXT))) == set(found)
    lines = TEXT.splitlines()
    assert lines[found["system", "tick_hz"] - 1] == "tick_hz = 20"
    assert lines[found["sensors", 1, "nmea", "sentences"] - 1] == 'sentences = "#"'
    assert lines[found["sensors", 1] - 1] == "[[sensors]]"
    assert lines[found["depth", "input", "keel_depth_m"] - 1] == "input.keel_depth_m = 1"
    assert lines[found["depth", "list", 1, "b"] - 1].strip() == "{ a = 1, b = 2 },"


@pytest.mark.parametrize("path", sorted(config.path().rglob("*.toml")), ids=lambda path: path.name)
def test_every_shipped_file_is_understood(path):
    text = path.read_text(encoding="utf-8")
    found = lines_of(text)
    data = tomllib.loads(text)
    assert set(keys(data)) <= set(found)
    for key in keys(data):
        if isinstance(key[-1], str):  # an outer table that has no line of its own shows its first inner one
            assert key[-1] in text.splitlines()[found[key] - 1]
