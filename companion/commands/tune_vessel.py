"""``companion tune vessel``: fit a boat's file to its own recorded voyages. The old file is never written over."""

from __future__ import annotations

import argparse
import datetime
import importlib.util
import math
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from ..core.hull import VesselConfig
from ..core.steer import SteeringConfig
from ..core.steer.bandwidth import GAIN_BAR_DB, PHASE_BAR_DEG
from ..io.whole_file import write_whole
from ..replay import ReplayError, recorded_vessel
from ..replay.sailed_by import folder_of, heading_latency_of, hull_of, moves_as, same_boat
from ..settings import ConfigError, load_vessel
from . import MissingExtraError, install_line
from .outputs import may_write
from .progress import ProgressLine

if TYPE_CHECKING:
    from ..tuning.fitted import Gains

_CROOKED_RAD = math.radians(5.0)
"""A baseline is laid along the hull by eye, to two or three degrees."""
EXAMPLES = """\
examples:
  companion tune vessel RUN_DIR                        a trial or an ordinary voyage; the file that it was sailed by is the start
  companion tune vessel log.csv --vessel blueboat --columns time=t,0,1000 heading=yaw,0,57.3 surge=u sway=v yaw_rate=r \\
      port=thr_right,1511,400 starboard=thr_left,1511,-400
                                                       any CSV: NAME=COLUMN[,ZERO,SCALE], (value - ZERO)/SCALE in s, rad, m/s, -1...1
"""
_FIT_S_PER_S: Final = 0.12
"""A core of a laptop fits ten minutes of record in 70 s."""
_HOUR_S: Final = 3600.0
_FITTED: Final = " fitted "
"""Between a boat's name and the day, in a fitted file: ``companion check`` shows a boat by her name alone."""


def register(actions: Any) -> None:
    """Add the action to ``companion tune``."""
    parser = actions.add_parser(
        "vessel",
        help="fit the vessel file to recorded voyages",
        description=__doc__,
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN_DIR|F.csv")
    parser.add_argument("--vessel", default="", help="the file to start from; default: the first run's own")
    parser.add_argument("--columns", nargs="+", default=[], metavar="NAME=COLUMN[,ZERO,SCALE]", help="of a foreign CSV")
    parser.add_argument("-o", "--output", type=Path, metavar="F.toml", help="default: NAME-fitted.toml here")
    parser.add_argument("--page", type=Path, metavar="F.html", help="default: beside the file")
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Fit, write the file and the page, say what changes. 1 when the record is too poor."""
    if any(importlib.util.find_spec(name) is None for name in ("scipy", "matplotlib", "control")):
        raise MissingExtraError(f"fitting needs scipy, matplotlib and python-control: {install_line('design')}")
    from ..tuning import fit_page, fitted, seed_fit
    from ..tuning.fit import fit_vessel
    from ..tuning.records.helms import unlike_file

    start = load_vessel(arguments.vessel) if arguments.vessel else _sailed_by(arguments.runs[0])
    print(f"from {arguments.vessel or f'the file that {arguments.runs[0].name} was sailed by'}: hull '{start.name}'")
    _of_one_boat(arguments.runs, start, named=bool(arguments.vessel))
    output = arguments.output or Path(f"{_plain(start.name)}-fitted.toml")
    if output.exists():
        raise ConfigError(str(output), ["is there already and is not written over; name another with -o"])
    page = arguments.page or output.with_suffix(".html")
    may_write(page, *arguments.runs)
    stretches = _stretches(arguments.runs, arguments.columns)
    source = ", ".join(run.name for run in arguments.runs)
    for text in (length_words(math.fsum(each.seconds for each in stretches)), *unlike_file(stretches, start)):
        print(text)
    with ProgressLine("fit", None) as progress:
        try:
            fit = fit_vessel(start, stretches, progress.say)
        except ValueError as error:
            progress.close()
            print(f"{source}: too poor for a fit: {error}", file=sys.stderr)
            return 1
        progress.say("margins over the confidence region")
        vessel = fitted.fitted_vessel(fit)
        gains = fitted.gains_for(fit, vessel, SteeringConfig())
        seed = seed_fit.seed_gains_for(fit, vessel, SteeringConfig())
    rows = fitted.changes(start, vessel, SteeringConfig())
    day = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    named = vessel.model_copy(update={"name": f"{_plain(start.name)}{_FITTED}{day}"})
    write_whole(output, fitted.as_toml(fit, named, source, day).encode("utf-8"))
    write_whole(page, fit_page.page(fit, vessel, rows, gains=gains, seed=seed, source=source).encode("utf-8"))
    _tell(fit, rows, gains)
    _tell_lateness(fit, [heading_latency_of(run) for run in arguments.runs])
    print(f"gains of the seed's law: {seed.words if seed else 'none on the grid hold at the worst corner'}")
    print(f"{output}, {page}: read them, {'but do not sail by them' if fitted.doubt(fit) else adopt_words(output)}")
    return 0


def adopt_words(output: Path) -> str:
    """How a file is adopted: found from every folder, and by the service, which sees nobody's home."""
    return f'then copy {output.name} beside the configuration and name it there: vessel = "CONFIG_DIR/{output.name}"'


def _plain(name: str) -> str:
    """A boat's name without the day of an earlier fit."""
    return name.partition(_FITTED)[0]


def _sailed_by(run: Path) -> VesselConfig:
    """The hull in a run's own recording. Raises ConfigError where there is none: a fit from another boat's file finds that boat."""
    folder = folder_of(run)
    if folder.is_file():
        raise ConfigError("--vessel", [f"name the file to start from; {run} is a table, and does not say who sailed"])
    try:
        return recorded_vessel(folder)
    except ReplayError as error:
        raise ConfigError(
            "--vessel", [f"name the file that {run} was sailed by; it does not hold it: {error}"]
        ) from None


def _of_one_boat(runs: list[Path], start: VesselConfig, *, named: bool) -> None:
    """Name runs that were sailed by another file. Raises ConfigError for another boat's, unless a person has named the file to start from:
    a file whose mass or size was mended since is such a one, too.
    """
    for run in runs:
        hull = hull_of(run)
        if hull is None or moves_as(hull, start):
            continue
        if not named and not same_boat(hull, start):
            mend = "leave it out, or name the boat's file with --vessel"
            raise ConfigError(str(run), [f"was sailed by the file of another boat ('{hull.name}'): {mend}"])
        print(f"{run.name}: was sailed by another hull file ('{hull.name}'); taken for the same boat")


def _stretches(runs: list[Path], columns: list[str]) -> list[Any]:
    from ..tuning.plausible import disbelieved
    from ..tuning.records.copies import taken_once
    from ..tuning.voyages import parse_columns, read_voyage

    try:
        chosen = parse_columns(columns)
    except ValueError as error:
        raise ConfigError("--columns", [str(error)]) from None
    found: list[Any] = []
    for run in runs:
        try:
            stretches = read_voyage(run, chosen, partial(_say_of, run))
            if text := disbelieved(stretches, chosen or None):
                raise ConfigError(str(run), [text])
            found += stretches
        except (OSError, ValueError) as error:
            raise ConfigError(str(run), [getattr(error, "strerror", None) or str(error)]) from None
    return taken_once(found, print)


def _say_of(run: Path, text: str) -> None:
    print(f"{run.name}: {text}")


def length_words(record_s: float) -> str:
    """How long a record is, what of it is fitted, and about how long that takes: said before somebody waits for it."""
    from ..tuning.windows import MOST_WINDOWS, WINDOW_S

    fitted_s = min(record_s, MOST_WINDOWS * WINDOW_S)
    part = "" if fitted_s == record_s else f", of which {_duration(fitted_s)} are fitted, evenly taken"
    taken_s = _FIT_S_PER_S * fitted_s
    return (
        f"{_duration(record_s)} of record{part}: takes about {_duration(taken_s)}, on a small computer four times that"
    )


def _duration(time_s: float) -> str:
    return f"{time_s / 3600.0:.1f} h" if time_s >= _HOUR_S else f"{max(1, round(time_s / 60.0))} min"


def margin_words(gains: Gains) -> str:
    """What the heading loop leaves at the worst corner of what is known: which margin misses its bar where, and what helps."""
    over = tuple(zip(gains.worst, gains.speeds, strict=True))
    gain, gain_at = min(((worst.gain_db, speed) for worst, speed in over))
    phase, phase_at = min(((worst.phase_deg, speed) for worst, speed in over))
    corner = "at the worst corner of what is known"
    if gains.holds:
        lowered = f"; set STEER_BW {gains.bandwidth:.2f}" if gains.lowered else ""
        least = f"{gain:.1f} dB (bar {GAIN_BAR_DB:g}) and {phase:.0f} deg (bar {PHASE_BAR_DEG:g})"
        return f"margins hold {corner}: at least {least}{lowered}"
    missed = [f"gain {_below(gain)} dB at {gain_at:.1f} m/s (bar {GAIN_BAR_DB:g})"] if gain < GAIN_BAR_DB else []
    if phase < PHASE_BAR_DEG:
        missed.append(f"phase {_below(phase)} deg at {phase_at:.1f} m/s (bar {PHASE_BAR_DEG:g})")
    if gains.up_to_mps > 0.0:
        mend = f"sail no faster than {_below(gains.up_to_mps)} m/s, or record more"
    elif gains.blown:
        mend = "by a lower STEER_BW wind would turn her away: record more (the whole trial, calmer water)"
    else:
        mend = "no lower STEER_BW mends it: record more (the whole trial, calmer water)"
    return f"margins MISS {corner}: {', '.join(missed)}; {mend}"


def _below(value: float) -> str:
    """Never rounded up: to a bar that it misses, or to a speed at which nothing is known to hold."""
    return f"{math.floor(value * 10.0) / 10.0:.1f}"


def _tell(fit: Any, rows: list[tuple[str, str, str]], gains: Any) -> None:
    from ..tuning.fitted import care, doubt, strayed
    from ..tuning.several import by_run

    print(f"{'':40} {'before':>10} {'fitted':>10}")
    for what, before, after in rows:
        print(f"{what:40} {before:>10} {after:>10}")
    names = ("surge", "sway", "yaw rate")
    said = (f"{n} {a:.2f} (before {b:.2f})" for n, a, b in zip(names, fit.errors, fit.errors_before, strict=True))
    print(f"error on stretches kept apart, RMS over standard deviation: {', '.join(said)}")
    for text in (*by_run(fit), doubt(fit) or care(fit), strayed(fit)):
        if text:
            print(text)
    if fit.turning != 1.0:
        print(
            f"what resists turning is {fit.turning:.2g} times what the file says, all of it: is thruster.lateral_m right?"
        )
    if fit.untold:
        print(f"not told by the record, left as before: {', '.join(u.name for u in fit.untold)}")
    print(margin_words(gains))
    _tell_compass(fit)


def _tell_lateness(fit: Any, set_s: Sequence[float | None]) -> None:
    """Say how late heading and position were recorded. ``set_s``: the age of headings that each run's settings reckoned with."""
    from ..tuning.effects import heading_late_s

    if text := late_heading_words(heading_late_s(fit), set_s):
        print(text)
    late_s, sure_s = fit.values.get("place_late", 0.0), 2.0 * fit.spread.get("place_late", 1.0)
    if late_s > max(sure_s, 0.05):
        print(f"recorded position is {late_s:.2f} s late: consider so much more nmea.position_latency_s")


def late_heading_words(late_s: float, set_s: Sequence[float | None]) -> str:
    """What to set for a heading that is recorded late, by what was set in each run; "" when it is not."""
    from ..tuning.effects import MOST_LATE_S

    if late_s <= 0.0:
        return ""
    known = {each for each in set_s if each is not None}
    said = f"recorded heading is at least {late_s:.2f} s late"
    if len(known) != 1 or None in set_s:
        return f"{said}: nmea.heading_latency_s may be {min(late_s, MOST_LATE_S):.2f} more than it was then, at most {MOST_LATE_S:g} in all"
    was_s = known.pop()
    if was_s >= MOST_LATE_S:
        return f"{said}: nmea.heading_latency_s was {was_s:g}, and more makes it worse; a quicker compass is needed"
    return f"{said}: nmea.heading_latency_s was {was_s:g}; set {min(was_s + late_s, MOST_LATE_S):.2f}"


def _tell_compass(fit: Any) -> None:
    """Say by how much the compass is off, when that is more than a baseline is usually mounted to."""
    off_rad, sure_rad = fit.values.get("heading_offset", 0.0), 2.0 * fit.spread.get("heading_offset", 1.0)
    if abs(off_rad) > max(sure_rad, _CROOKED_RAD):
        off_deg = math.degrees(off_rad)
        print(
            f"the compass is {abs(off_deg):.0f} degrees off (within {math.degrees(sure_rad):.0f}): "
            f"add {-off_deg:+.0f} to estimate.heading_offset_deg before you sail; the file reckons without it"
        )
