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


def main(path: str) -> None:
    vectors = json.loads(Path(path).read_text(encoding="utf-8"))
    print("// Made from vectors.json by vectors.py.\n#pragma once\n#include <string>\n#include <vector>")
    print("struct CrcVector { std::string text; unsigned crc; };")
    print("struct EncodeVector { unsigned pulses[4]; std::string newline, bare, checked; };")
    print("struct DecodeVector { const char *name; bool strict; std::string send; unsigned pulses[4]; ")
    print("    std::vector<std::string> words; unsigned bad; };")
    print("static const std::vector<CrcVector> kCrcVectors = {")
    for item in vectors["crc8"]:
        print(f"    {{{text(item['text'])}, 0x{item['crc']}}},")
    print("};\nstatic const std::vector<EncodeVector> kEncodeVectors = {")
    for item in vectors["encode"]:
        sent = ", ".join(text(item[key]) for key in ("level0_newline", "level0_bare", "level1"))
        print(f"    {{{pins(item['pulses'])}, {sent}}},")
    print("};\nstatic const std::vector<DecodeVector> kDecodeVectors = {")
    for item in vectors["decode"]:
        words = ", ".join(text(word) for word in item["words"])
        print(
            f"    {{{json.dumps(item['name'])}, {str(item['strict']).lower()}, {text(item['send'])}, "
            f"{pins(item['pulses'])}, {{{words}}}, {item['bad']}}},"
        )
    print("};")


if __name__ == "__main__":
    main(sys.argv[1])
