"""Runs every benchmark and writes build/bench.json and build/bench.md.

A benchmark is a module ``tools/benches/*.py`` with ``run() -> list[dict]``; a row is {name, value, unit, bar, holds}, with
None for a figure that has no bar. ``make bench BENCH_ARGS="nmea vessel"`` runs those whose name contains a word.
"""

from __future__ import annotations

import argparse
import importlib
import json
import platform
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any

REPO = Path(__file__).resolve().parents[1]
KEYS = ("name", "value", "unit", "bar", "holds")


def modules(words: Sequence[str] = ()) -> list[str]:
    """Names of the benchmark modules, filtered by words."""
    found = sorted(path.stem for path in (REPO / "tools" / "benches").glob("[a-z]*.py"))
    return [name for name in found if not words or any(word in name for word in words)]


def collect(names: Sequence[str]) -> list[dict[str, Any]]:
    """Run the modules one after the other; one that fails is a row that does not hold."""
    rows: list[dict[str, Any]] = []
    for number, name in enumerate(names, 1):
        print(f"[{number}/{len(names)}] {name} ...", file=sys.stderr, flush=True)
        began = time.monotonic()
        try:
            rows += [checked(row) for row in importlib.import_module(f"tools.benches.{name}").run()]
        except Exception:
            traceback.print_exc()
            rows.append({"name": f"{name} failed", "value": None, "unit": "", "bar": None, "holds": False})
        print(f"    {time.monotonic() - began:.1f} s", file=sys.stderr, flush=True)
    return rows


def checked(row: dict[str, Any]) -> dict[str, Any]:
    """A row with all keys and no others. Raises ValueError."""
    if set(row) != set(KEYS):
        raise ValueError(f"a benchmark row has {', '.join(KEYS)}; this one has {', '.join(row)}")
    return {key: row[key] for key in KEYS}


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The rows as a Markdown table."""
    lines = ["| benchmark | value | unit | bar | holds |", "| --- | ---: | --- | ---: | --- |"]
    for row in rows:
        mark = {True: "yes", False: "**no**", None: ""}[row["holds"]]
        lines.append(f"| {row['name']} | {_number(row['value'])} | {row['unit']} | {_number(row['bar'])} | {mark} |")
    return "\n".join(lines) + "\n"


def _number(value: Any) -> str:
    if isinstance(value, str):
        return value  # a bar that says how it is meant: "<= 35"
    return "" if value is None else f"{value:,.4g}" if isinstance(value, float) and abs(value) < 1e4 else f"{value:,}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run, write, print; exit status 1 when a bar is missed."""
    parser = argparse.ArgumentParser(description="run the benchmarks")
    parser.add_argument("words", nargs="*", help="only modules whose name contains one of these")
    parser.add_argument("-o", "--output", type=Path, default=REPO / "build")
    arguments = parser.parse_args(argv)
    names = modules(arguments.words)
    if not names:
        print(f"no benchmark matches; there are {', '.join(modules())}", file=sys.stderr)
        return 2
    rows = collect(names)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "bench.json").write_text(json.dumps(rows, indent=1) + "\n")
    where = f"Python {platform.python_version()}, {platform.machine()}"
    (arguments.output / "bench.md").write_text(f"# Benchmarks\n\n{where}\n\n{table(rows)}")
    print(table(rows))
    missed = [row["name"] for row in rows if row["holds"] is False]
    print(
        f"{len(rows)} figures, {len(missed)} below their bar; {arguments.output}/bench.json, bench.md", file=sys.stderr
    )
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
