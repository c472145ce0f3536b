"""Identification from a recorded run: Nomoto's K and T from a step, a turn or a zig-zag.

Output error: for each lag and delay that are tried the answer of a first-order hull is linear in its gains, so these come
from least squares and the best lag is kept. Noise on the measured rate does not shorten the lag, as it does in an equation
that holds the measured rate on both sides; a command recorded before its actuator has followed only adds to the delay.
A boat without rudders steers by the difference of its thrusts, which then is the input. Needs numpy and scipy (``design``).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

_LAGS_S: Final = tuple(0.05 * 1.09**k for k in range(90))
"""From an eddy to a ship: 0.05 to 107 s."""
_DELAYS_S: Final = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.9, 1.3)
_STEP_S: Final = 0.1
"""Records are brought to this step, unless theirs is longer."""
_STEADY: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Nomoto:
    """r' = (K input(t - delay) - r)/T + b."""

    gain: float
    """Static gain, (rad/s) per unit of the input: per radian of rudder, or per unit of thrust's difference."""
    lag_s: float
    bias: float
    """Constant yaw acceleration, rad/s²."""
    fit: float
    """1 - RMS of the simulated rate's error over the standard deviation of the measured one; 1 is perfect."""
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class RunColumns:
    """Columns of a run: seconds, what steered, yaw rate in rad/s."""

    times_s: list[float]
    inputs: list[float]
    rates: list[float]
    unit: str = "input"
    """What one unit of the input is: 'rad of rudder', 'of thrust's difference', 'input'."""

    def between(self, start_s: float, end_s: float) -> RunColumns:
        """Return the part between two times."""
        kept = [k for k, t in enumerate(self.times_s) if start_s <= t <= end_s]
        times, inputs, rates = ([values[k] for k in kept] for values in (self.times_s, self.inputs, self.rates))
        return RunColumns(times, inputs, rates, self.unit)


KNOWN_COLUMNS: Final = (
    ("t_s", "rudder_port_deg", "yaw_rate_dps"),
    ("t [s]", "delta_rudder [rad]", "r_angvelo [rad/s]"),
)
"""Time, input, yaw rate: truth.csv and control.csv of a run, and the ship-model runs that came with the project."""
THRUSTERS: Final = ("t_s", "thruster_port", "thruster_starboard", "yaw_rate_dps")
"""The same of a boat that steers by its propellers."""


def read_columns(path: Path, columns: Sequence[str] | None = None) -> RunColumns:
    """Return a record from a CSV file; degrees are converted by the column's name.

    Of a run's directory it is truth.csv, or control.csv of a real vessel. Where the rudder never moves and the propellers
    differ, half the difference of the squared commands is the input: what thrust goes with. Raises ValueError when the
    columns are not there.
    """
    if path.is_dir():
        path = path / ("truth.csv" if (path / "truth.csv").is_file() else "control.csv")
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.DictReader(file)
        names = list(rows.fieldnames or ())
        table = list(rows)
    known = next((known for known in KNOWN_COLUMNS if set(known) <= set(names)), None)
    wanted = tuple(columns) if columns else known
    by_thrust = not columns and set(THRUSTERS) <= set(names)
    if (wanted is None or not set(wanted) <= set(names)) and not by_thrust:
        told = f"it has {', '.join(names)}" if names else "it has none"
        raise ValueError(f"name the columns of time, input and yaw rate with --columns; {told}")
    record = None if wanted is None else _columns(table, wanted)
    if by_thrust and (record is None or _still(record.inputs)):
        other = _difference(table)
        if record is None or (other is not None and not _still(other.inputs)):
            record = other
    if record is None or not record.times_s:
        raise ValueError(f"holds no row with {', '.join(wanted or THRUSTERS)}")
    return record


def _columns(table: list[dict[str, str]], wanted: Sequence[str]) -> RunColumns:
    records = [tuple(float(row[name]) for name in wanted) for row in table if all(row[name] for name in wanted)]
    scales = [math.pi / 180.0 if name.endswith(("_deg", "_dps")) else 1.0 for name in wanted]
    times, inputs, rates = ([record[k] * scales[k] for record in records] for k in range(3))
    times = [record[0] for record in records]
    return RunColumns(times, inputs, rates, "rad of rudder" if wanted in KNOWN_COLUMNS else "input")


def _difference(table: list[dict[str, str]]) -> RunColumns | None:
    records = [tuple(float(row[name]) for name in THRUSTERS) for row in table if all(row[name] for name in THRUSTERS)]
    inputs = [0.5 * (port * abs(port) - starboard * abs(starboard)) for _, port, starboard, _ in records]
    return RunColumns([r[0] for r in records], inputs, [math.radians(r[3]) for r in records], "of thrust's difference")


def _still(values: Sequence[float]) -> bool:
    return not values or max(values) - min(values) < _STEADY


def identify(times_s: Sequence[float], inputs: Sequence[float], rates: Sequence[float]) -> Nomoto:
    """Return the best first-order model. Raises ValueError when the record excites nothing or no stable answer fits."""
    import numpy

    t, delta, r = (numpy.asarray(values, dtype=float) for values in (times_s, inputs, rates))
    if len(t) < 20 or float(numpy.std(delta)) < _STEADY or float(numpy.std(r)) < _STEADY:
        raise ValueError("the record holds no manoeuvre: the input or the yaw rate does not change")
    step = max(_STEP_S, float(numpy.median(numpy.diff(t))))
    even = numpy.arange(t[0], t[-1], step)
    rate = numpy.interp(even, t, r)
    best: tuple[float, Any, float, float] | None = None
    for delay_s in _DELAYS_S:
        # what was recorded at a sample holds until the next
        held = delta[numpy.clip(numpy.searchsorted(t, even - delay_s, side="right") - 1, 0, len(delta) - 1)]
        for lag_s in _LAGS_S:
            found, size = _fitted(held, rate, step, lag_s)
            if best is None or size < best[0]:
                best = (size, found, lag_s, delay_s)
    assert best is not None
    size, (gain, bias, _), lag_s, delay_s = best
    if lag_s >= _LAGS_S[-1]:
        raise ValueError(
            "no stable first-order answer is in this record: the hull is course-unstable, or it is too short"
        )
    return Nomoto(float(gain), lag_s, float(bias) / lag_s, 1.0 - size / float(numpy.std(rate)), delay_s)


def _fitted(held: Any, rate: Any, step_s: float, lag_s: float) -> tuple[Any, float]:
    """Least squares of gain, bias and start for one lag; return them and the RMS of the error."""
    import numpy
    from scipy.signal import lfilter

    keep = math.exp(-step_s / lag_s)
    answer = lfilter([0.0, 1.0 - keep], [1.0, -keep], held)
    fading = keep ** numpy.arange(len(rate))
    columns = numpy.column_stack([answer, 1.0 - fading, fading])
    found, *_ = numpy.linalg.lstsq(columns, rate, rcond=None)
    return found, float(numpy.sqrt(numpy.mean((columns @ found - rate) ** 2)))
