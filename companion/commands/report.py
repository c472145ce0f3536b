"""``companion report``: what happened, as one HTML file for somebody who was not there."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
from pathlib import Path
from typing import Any

from mavlink_bridge.mavlink.wire import tlog

from ..io.whole_file import write_whole
from ..report.flight import Count, Flight, uncounted
from ..report.from_run import bytes_of, read_run
from ..report.from_tlog import read_tlog
from ..report.page import make_page
from ..report.verdicts import WORDS, RunLimits, judge
from ..settings import ConfigError
from ..settings.device import no_device
from . import MissingExtraError, install_line
from .numbers import number
from .outputs import may_write
from .progress import ProgressLine


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("report", help="HTML report of a run or a tlog", description=__doc__)
    parser.add_argument("source", type=Path, metavar="RUN_DIR|F.tlog")
    parser.add_argument(
        "-o", "--output", type=Path, metavar="F.html", help="default: report.html in RUN_DIR, or F.html"
    )
    parser.add_argument("--picture", type=Path, metavar="F.png", help="also write the map as a picture")
    parser.add_argument(
        "--limit", action="append", default=[], metavar="NAME=VALUE", help=f"one of {', '.join(_limit_names())}"
    )
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Write the report and print the summary; exit status 0, 2 when there is nothing to read."""
    limits = read_limits(arguments.limit)
    output = arguments.output or default_output(arguments.source)
    for out in (output, arguments.picture):
        may_write(out, arguments.source)
    with ProgressLine("reading", None) as shown:
        flight = read(arguments.source, shown)
    with ProgressLine("report", None) as shown:
        shown.say("drawing ...")
        text = make_page(flight, limits)
        picture = _picture(flight) if arguments.picture else None
    write_whole(output, text.encode("utf-8"))
    if picture is not None:
        write_whole(arguments.picture, picture)
    for verdict in judge(flight, limits):
        mark = WORDS[verdict.ok] if verdict.ok is not False else WORDS[False].upper()
        print(f"  {verdict.name:40} {verdict.value:>18}  {verdict.limit:14} {mark}")
    print(output)
    return 0


def _picture(flight: Flight) -> bytes | None:
    """The map as PNG; None without anything to draw."""
    if importlib.util.find_spec("matplotlib") is None:
        raise MissingExtraError(f"a picture file needs matplotlib: {install_line('report')}")
    from ..report.map_plot import draw_map
    from ..report.plots import as_png

    made = draw_map(flight)
    return None if made is None else as_png(made)


def _counted(shown: ProgressLine | None, total: int) -> Count:
    """What shows how far the reading is."""
    if shown is None:
        return uncounted
    done = 0

    def count(more: int) -> None:
        nonlocal done
        done += more
        shown.count(done / 1e6, total / 1e6, "MB")

    return count


def read(source: Path, shown: ProgressLine | None = None) -> Flight:
    """Read a run directory or a telemetry log. Raises ConfigError when it is neither."""
    try:
        if source.is_dir():
            if not (any(source.glob("*.json*")) or any(source.glob("*.tlog"))):
                raise ConfigError(str(source), ["holds no run: give a run directory or a telemetry log"])
            return read_run(source, _counted(shown, bytes_of(source)))
        what = tlog.not_a_log(no_device(source).read_bytes())
        if what:
            raise ConfigError(str(source), [f"{what}; give a run directory or a telemetry log"])
        ours = source.name.startswith("mavlink") and (source.parent / "run.json").is_file()
        flight = read_tlog(source, numbered=ours, count=_counted(shown, source.stat().st_size))
    except OSError as error:
        raise ConfigError(str(source), [f"cannot be read: {error.strerror or error}"]) from None
    if "frames" not in flight.about:
        raise ConfigError(str(source), ["holds no MAVLink frame: give a run directory or a telemetry log"])
    return flight


def default_output(source: Path) -> Path:
    """Where the report goes when nobody says."""
    return source / "report.html" if source.is_dir() else source.with_suffix(".html")


def _limit_names() -> list[str]:
    return [field.name for field in dataclasses.fields(RunLimits)]


def read_limits(changes: list[str]) -> RunLimits:
    """Apply ``name=value`` to the limits. Raises ConfigError with every mistake."""
    values: dict[str, float] = {}
    mistakes = []
    for item in changes:
        name, _, text = item.partition("=")
        try:
            values[name] = number(0.0)(text)
        except argparse.ArgumentTypeError:
            mistakes.append(f"--limit {item}: write it as name=number, the number 0 or more")
        if name not in _limit_names():
            mistakes.append(f"--limit {item}: no such limit; known: {', '.join(_limit_names())}")
    if mistakes:
        raise ConfigError("--limit", mistakes)
    return RunLimits(**values)
