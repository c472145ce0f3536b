"""Turn vectors.json into a C++ header for the host tests."""

import json
import sys
from pathlib import Path


def text(value: str) -> str:
    """Bytes as a C++ string literal, with its length (the text may hold NUL)."""
    raw = value.encode("latin-1")
    escaped = "".join(f'\\x{byte:02x}""' for byte in raw)
    return f'{{"{escaped}", {len(raw)}}}'


def pins(values: list) -> str:
    return "{" + ", ".join(str(value or 0) for value in values) + "}"


HEAD = """// Made from vectors.json by vectors.py.
#pragma once
#include <string>
#include <vector>
struct CrcVector { std::string text; unsigned crc; };
struct EncodeVector { unsigned pulses[4]; std::string newline, bare, checked; };
struct DecodeVector {
    const char *name; bool strict; std::string send; unsigned pulses[4]; std::vector<std::string> words; unsigned bad;
};"""


def header(vectors: dict) -> str:
    """Return the whole header."""
    lines = [HEAD, "static const std::vector<CrcVector> kCrcVectors = {"]
    lines += [f"    {{{text(item['text'])}, 0x{item['crc']}}}," for item in vectors["crc8"]]
    lines += ["};", "static const std::vector<EncodeVector> kEncodeVectors = {"]
    for item in vectors["encode"]:
        sent = ", ".join(text(item[key]) for key in ("level0_newline", "level0_bare", "level1"))
        lines.append(f"    {{{pins(item['pulses'])}, {sent}}},")
    lines += ["};", "static const std::vector<DecodeVector> kDecodeVectors = {"]
    for item in vectors["decode"]:
        words = ", ".join(text(word) for word in item["words"])
        lines.append(
            f"    {{{json.dumps(item['name'])}, {str(item['strict']).lower()}, {text(item['send'])}, "
            f"{pins(item['pulses'])}, {{{words}}}, {item['bad']}}},"
        )
    return "\n".join([*lines, "};", ""])


if __name__ == "__main__":
    sys.stdout.write(header(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))))
