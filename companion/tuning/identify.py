"""Identification from a recorded run: Nomoto's K and T from a step, a turn or a zig-zag.

The integral form r(t) - r(0) = -(1/T) ∫r + (K/T) ∫δ + b t is solved by least squares: no derivative of a noisy rate is
taken, and a slow bias (trim, wind) has its own column. Needs numpy (``design`` extra).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Nomoto:
    """r' = (K δ - r)/T + b."""

    gain: float
    """Static gain, (rad/s) per unit of the input."""
    lag_s: float
    bias: float
    """Constant yaw acceleration, rad/s²."""
    fit: float
    """1 - RMS of the simulated rate's error over the standard deviation of the measured one; 1 is perfect."""


KNOWN_COLUMNS = (
    ("t_s", "rudder_port_deg", "yaw_rate_dps"),
    ("t [s]", "delta_rudder [rad]", "r_angvelo [rad/s]"),
)
"""Time, input, yaw rate: truth.csv of a simulated run, and the ship-model runs that came with the project."""


def read_columns(path: Path, columns: Sequence[str] | None = None) -> tuple[list[float], list[float], list[float]]:
    """Return (seconds, input, yaw rate in rad/s) of a CSV file; degrees are converted by the column's name.

    Of a run's directory it is truth.csv, or control.csv of a real vessel. Raises ValueError when the columns are not there.
    """
    if path.is_dir():
        path = path / ("truth.csv" if (path / "truth.csv").is_file() else "control.csv")
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.DictReader(file)
        names = list(rows.fieldnames or ())
        wanted = (
            tuple(columns) if columns else next((known for known in KNOWN_COLUMNS if set(known) <= set(names)), None)
        )
        if wanted is None or not set(wanted) <= set(names):
            told = f"it has {', '.join(names)}" if names else "it has none"
            raise ValueError(f"name the columns of time, input and yaw rate with --columns; {told}")
        records = [tuple(float(row[name]) for name in wanted) for row in rows if all(row[name] for name in wanted)]
    if not records:
        raise ValueError(f"holds no row with {', '.join(wanted)}")
    scales = [math.pi / 180.0 if name.endswith(("_deg", "_dps")) else 1.0 for name in wanted]
    times, inputs, rates = zip(*records, strict=True)
    return list(times), [value * scales[1] for value in inputs], [value * scales[2] for value in rates]


def identify(times_s: Sequence[float], inputs: Sequence[float], rates: Sequence[float]) -> Nomoto:
    """Return the best first-order model. Raises ValueError when the record excites nothing or the lag comes out negative."""
    import numpy

    t, delta, r = (numpy.asarray(values, dtype=float) for values in (times_s, inputs, rates))
    if len(t) < 20 or float(numpy.std(delta)) < 1e-6 or float(numpy.std(r)) < 1e-6:
        raise ValueError("the record holds no manoeuvre: the input or the yaw rate does not change")
    dt = numpy.diff(t)
    area_r = numpy.concatenate([[0.0], numpy.cumsum(0.5 * (r[1:] + r[:-1]) * dt)])
    area_delta = numpy.concatenate([[0.0], numpy.cumsum(delta[:-1] * dt)])
    columns = numpy.column_stack([-area_r, area_delta, t - t[0], numpy.ones_like(t)])
    (rate, ratio, bias, start), *_ = numpy.linalg.lstsq(columns, r, rcond=None)
    if rate <= 0.0:
        raise ValueError(
            "no stable first-order answer is in this record: the hull is course-unstable, or it is too short"
        )
    simulated = _simulate(t, delta, float(rate), ratio=float(ratio), bias=float(bias), start=float(start))
    fit = 1.0 - float(numpy.sqrt(numpy.mean((simulated - r) ** 2)) / numpy.std(r))
    return Nomoto(float(ratio / rate), float(1.0 / rate), float(bias), fit)


def _simulate(t, delta, rate: float, ratio: float, bias: float, start: float):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    import numpy

    r = numpy.empty_like(t)
    r[0] = start
    for k in range(1, len(t)):
        dt = t[k] - t[k - 1]
        keep = math.exp(-rate * dt)
        r[k] = keep * r[k - 1] + (1.0 - keep) * (ratio * delta[k - 1] + bias) / rate
    return r
