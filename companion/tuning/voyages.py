"""Recorded voyages for the fit: control.csv of a run or any CSV with named columns, on an even grid, cut where seconds are lost.

Needs numpy and scipy (``design``). Measured are surge and sway over ground in the hull's axes and the yaw rate. A run of our own
holds each fix as its receiver told it, and that is taken: between fixes the state is the estimator's own, which a fit would learn
for the hull's. Where a record holds neither fixes nor sway, sway is a difference of places, smoothed by a parabola over a second
(Savitzky-Golay).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from mavlink_bridge.language.geodesy import metres_per_radian

from .hull_arrays import STEP_S
from .records.tables import Tell, columns_of, header_of

Array = Any

_LOST_S: Final = 0.7
"""A record that is silent for longer goes on as another stretch."""
_LATE_S: Final = 1.0
"""Rows come out of order by less where sources are merged or a thread waits; a clock that begins again or is set steps back further."""
SHORTEST_S: Final = 5.0
_SELDOM_S: Final = 1.2
"""A row a second taught a catamaran of 30 kg and a launch of 2 t: speeds within 3 % above a third of the throttle, ways to rest long."""
_SLOW_S: Final = 0.7
"""From here on an owner is told what such a log can not tell."""
_GAP_PERIODS: Final = 1.5
_FULL: Final = 1.05
"""A pulse of 1100 us for full astern, where the middle is 1511 and full ahead 400 more, comes to 1.03."""
_REACH: Final = {
    "port": (_FULL, "-1 to 1"),
    "starboard": (_FULL, "-1 to 1"),
    "rudder": (0.5 * math.pi, "radians"),
    "lat": (90.0, "degrees of -90 to 90"),
    "lon": (360.0, "degrees of -180 to 180"),
}
"""How far what a column tells can go, and its unit. Some count longitude to 360."""
_E7: Final = 1e6
"""Places beyond it are counted in whole numbers, as MAVLink does; in ddmm.mm they come to 18 000."""
_SPIKES: Final = 0.01
"""Share of the values beyond, up to which they are spikes; what is more is a unit."""
_PULSES_US: Final = (700.0, 2300.0)
_PERCENT: Final = (10.0, 110.0)
_CLOCKS: Final = {"ms": 1e3, "us": 1e6, "ns": 1e9}
_OFTEN_S: Final = 0.004
"""No logger of a boat writes oftener: a shorter period is not what a unit of time is guessed by."""
SMOOTH_STEPS: Final = 21
"""Over so many steps, 1 s, velocities are taken from places; the model's are smoothed alike."""
_MEANINGS: Final = (
    *("time", "heading", "port", "starboard", "rudder", "surge", "sway", "yaw_rate", "lat", "lon", "armed"),
    *("fix_north", "fix_east", "fix_age"),
)
_NEEDED: Final = ("time", "heading", "port", "yaw_rate")
_COMMANDS: Final = ("port", "starboard", "rudder")
_PLACES: Final = ("lat", "lon")


@dataclass(frozen=True, slots=True)
class Column:
    """Where a quantity stands: (value - zero) / scale, in s, rad, m/s, commands -1...1, degrees for lat and lon."""

    name: str
    zero: float = 0.0
    scale: float = 1.0


_DEGREE: Final = 180.0 / math.pi
RUN_COLUMNS: Final = {
    "time": Column("t_s"),
    "heading": Column("heading_deg", 0.0, _DEGREE),
    "port": Column("thruster_port"),
    "starboard": Column("thruster_starboard"),
    "rudder": Column("rudder_port_deg", 0.0, _DEGREE),
    "surge": Column("speed_mps"),
    "yaw_rate": Column("yaw_rate_dps", 0.0, _DEGREE),
    "lat": Column("lat_deg"),
    "lon": Column("lon_deg"),
    "armed": Column("armed"),
    "fix_north": Column("fix_n_mps"),
    "fix_east": Column("fix_e_mps"),
    "fix_age": Column("fix_age_s"),
}
"""control.csv of a run. Without fixes, sway comes from the places."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of a voyage without a gap, every ``STEP_S``: commands, heading, and what was measured."""

    source: str
    start_s: float
    port: Array
    starboard: Array
    rudder_rad: Array
    psi_rad: Array
    surge: Array
    sway: Array
    rate: Array
    from_places: bool = False
    """Sway is smoothed over ``SMOOTH_STEPS``."""
    age_s: Array | None = None
    """Where velocities come from fixes: how old each was at its step; there is none, and surge and sway are NaN, where none came."""
    track: tuple[Array, Array] | None = None
    """Surge and sway that the places make, where a record tells speeds and places."""

    @property
    def seconds(self) -> float:
        return len(self.port) * STEP_S


def parse_columns(texts: Sequence[str]) -> dict[str, Column]:
    """Read ``port=thr_right,1500,400`` (column, its zero, its full scale). Raises ValueError with the mend."""
    found: dict[str, Column] = {}
    for text in texts:
        meaning, _, rest = text.partition("=")
        parts = rest.split(",")
        if meaning not in _MEANINGS or not parts[0] or len(parts) > 3:
            raise ValueError(f"{text!r}: write NAME=COLUMN[,ZERO,SCALE] with NAME one of {', '.join(_MEANINGS)}")
        try:
            numbers = [float(part) for part in parts[1:]]
        except ValueError:
            raise ValueError(f"{text!r}: zero and scale are numbers") from None
        found[meaning] = Column(parts[0], *numbers)
    return found


def _silent(_: str) -> None:
    """For whoever wants the motion alone."""


def read_voyage(path: Path, columns: Mapping[str, Column] | None = None, tell: Tell = _silent) -> list[Stretch]:
    """Return the stretches of a run's directory or a CSV file. Raises ValueError when it holds none.

    ``tell`` is called with what whoever recorded it should know.
    """
    file = path / "control.csv" if path.is_dir() else path
    names = header_of(file)
    chosen = dict(columns) if columns else {k: column for k, column in RUN_COLUMNS.items() if column.name in names}
    missing = [meaning for meaning in _NEEDED if meaning not in chosen]
    absent = [column.name for column in chosen.values() if column.name not in names]
    if missing or absent:
        what = f"has no column {', '.join(absent)}" if absent else f"no column is named for {', '.join(missing)}"
        raise ValueError(
            f"{what}; its columns are {', '.join(names)}; name them with --columns time=COLUMN heading=COLUMN ..."
        )
    table = columns_of(file, sorted({column.name for column in chosen.values()}), tell)
    values = {meaning: (table[column.name] - column.zero) / column.scale for meaning, column in chosen.items()}
    for name in (each for each in _REACH if each in values):
        values[name] = _in_range(name, values[name], chosen[name], tell)
    found = _stretches(str(path), values, tell)
    if not found:
        raise ValueError(_why_none(values, chosen))
    period_s = float(np.nanmedian(np.abs(np.diff(values["time"]))))
    if period_s > _SLOW_S:
        tell(
            f"a row comes every {period_s:.2g} s: what is quicker (lags, yaw inertia) is told roughly; five a second tell it"
        )
    return found


def _in_range(name: str, value: Array, column: Column, tell: Tell) -> Array:
    """A value without its spikes. Raises ValueError where it is in another unit: cut off in silence it would be another command."""
    most, unit = _REACH[name]
    with np.errstate(invalid="ignore"):
        beyond = np.abs(value) > most
    if not beyond.any():
        return value
    if beyond.sum() > _SPIKES * np.isfinite(value).sum():
        low, high = (float(np.nanpercentile(value, end)) for end in (0.5, 99.5))
        raise ValueError(
            f"{name} (column {column.name}) goes from {low:.4g} to {high:.4g}, and is {unit}; "
            f"{_mended(name, (low, high), column)}"
        )
    tell(f"{name} (column {column.name}): {int(beyond.sum())} values beyond {unit} are left out")
    return np.where(beyond, math.nan, value)


def _mended(name: str, reach: tuple[float, float], column: Column) -> str:
    """What a person should do about a column that goes beyond its reach."""
    if name == "lat" and max(map(abs, reach)) <= 0.5 * _REACH["lon"][0]:
        return "are lat and lon changed over?"
    if name in _PLACES and max(map(abs, reach)) < _E7:
        return "are these degrees and minutes (ddmm.mm)? then make degrees of them"
    return f"give its zero and scale: --columns {name}={column.name},{_guessed(name, reach, column)}"


def _guessed(name: str, reach: tuple[float, float], column: Column) -> str:
    """Zero and scale that such values look to have."""
    low, high = (column.zero + column.scale * end for end in reach)
    most = max(abs(low), abs(high))
    if name == "rudder":
        return f"{column.zero:g},57.296 if it is in degrees"
    if name in _PLACES:
        return "0,1e7 if it is in 1e-7 degrees"
    if _PULSES_US[0] < low and high < _PULSES_US[1]:
        return "1500,400 if it is in us"
    return "0,100 if it is in percent" if _PERCENT[0] < most < _PERCENT[1] else "ZERO,SCALE"


def _why_none(values: dict[str, Array], chosen: Mapping[str, Column]) -> str:
    """Why a table holds no stretch: an empty column, a vessel at rest, rows that come too seldom, or too many gaps."""
    places = not {"surge", "sway"} <= values.keys()
    needed = [*_NEEDED, *(("lat", "lon") if places else ("surge", "sway"))]
    for name in needed:
        if not np.isfinite(values[name]).any():
            return f"column {chosen[name].name} ({name}) holds no number in any row"
    if "armed" in values and not (values["armed"] > 0.5).any():
        return f"column {chosen['armed'].name} (armed) is never 1: it was never under way"
    motion = [np.isfinite(values[name]) for name in needed if name not in _COMMANDS]
    steps = np.diff(values["time"][np.logical_and.reduce(motion)])
    if len(steps) < 2:
        return f"hardly a row holds {', '.join(name for name in needed if name not in _COMMANDS)} together"
    period_s = float(np.median(steps))
    if period_s > _SELDOM_S:
        unit = _unit(period_s, chosen["time"])
        return f"a row comes every {period_s:.3g} s; a fit needs one every {_SELDOM_S:g} s or oftener{unit}"
    lasts_s = math.fsum(steps[steps > 0.0])
    return (
        f"holds no stretch of {SHORTEST_S:g} s and more without a gap of {_LOST_S:g} s; it lasts {lasts_s:.3g} s in all"
    )


def _unit(period_s: float, time: Column) -> str:
    """The unit that a time looks to be in, with the mend; "" when it looks like seconds."""
    for unit, scale in _CLOCKS.items():
        if _OFTEN_S <= period_s / scale <= _SELDOM_S:
            return f"; is {time.name} in {unit}? then --columns time={time.name},{time.zero:g},{scale * time.scale:g}"
    return ""


def _held(value: Array) -> Array:
    """A command stands until the next one is told: where a cell holds none it is as before. NaN before the first."""
    told = np.isfinite(value)
    newest = np.maximum.accumulate(np.where(told, np.arange(len(value)), -1))
    return np.where(newest >= 0, value[newest], math.nan)


def _stretches(source: str, values: dict[str, Array], tell: Tell) -> list[Stretch]:
    speeds = "surge" in values and "sway" in values
    if not speeds and not ("lat" in values and "lon" in values):
        raise ValueError("neither surge and sway nor lat and lon: name the columns that hold the motion over ground")
    found = []
    for going_on in _in_order(values["time"], tell):
        part = {name: value[going_on] for name, value in values.items()}
        # before rows are left out: a log of two sources tells commands where it tells no heading
        part |= {name: _held(part[name]) for name in _COMMANDS if name in part}
        found += [_even(source, whole, speeds) for whole in _without_gaps(part, speeds)]
    return found


def _in_order(time: Array, tell: Tell) -> list[Array]:
    """The rows of each record, by time: a row that is a little late is put where it belongs, farther back another record begins."""
    rows = np.flatnonzero(np.isfinite(time))
    told = time[rows]
    back = np.flatnonzero(np.diff(told) <= -_LATE_S) + 1
    if len(back):
        tell(_steps_back(told, back))
    late = int((np.diff(told) < 0.0).sum()) - len(back)
    if late:
        tell(f"time steps back by less than {_LATE_S:g} s {_times(late)}: these rows are put in order")
    return [part[np.argsort(time[part], kind="stable")] for part in np.split(rows, back)]


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _steps_back(time: Array, back: Array) -> str:
    """What is told of a clock that began again, or was set: nothing may be reckoned over that moment."""
    first = back[0]
    return (
        f"time steps back {_times(len(back))} (first from {time[first - 1]:g} to {time[first]:g} s): "
        "what comes after is taken as another record"
    )


def _without_gaps(part: dict[str, Array], speeds: bool) -> list[dict[str, Array]]:
    """The parts of a record, whose time never steps back, in which nothing is lost for long."""
    time = part["time"]
    good = np.isfinite(part["heading"]) & np.isfinite(part["yaw_rate"])
    for name in _COMMANDS:
        good &= np.isfinite(part.get(name, 0.0))
    if "armed" in part:
        good &= part["armed"] > 0.5
    good &= np.isfinite(part["surge"] + part["sway"]) if speeds else np.isfinite(part["lat"] + part["lon"])
    kept = np.flatnonzero(good)
    if len(kept) < 2:
        return []
    kept = kept[np.concatenate([[True], np.diff(time[kept]) > 1e-6])]
    period_s = float(np.median(np.diff(time[kept]))) if len(kept) > 1 else 0.0
    lost_s = max(_LOST_S, _GAP_PERIODS * period_s) if period_s <= _SELDOM_S else _LOST_S
    cuts = np.flatnonzero(np.diff(time[kept]) > lost_s) + 1
    long = [rows for rows in np.split(kept, cuts) if time[rows[-1]] - time[rows[0]] > SHORTEST_S]
    return [{name: value[rows] for name, value in part.items()} for rows in long]


def _even(source: str, part: dict[str, Array], speeds: bool) -> Stretch:
    time = part["time"]
    grid = np.arange(time[0], time[-1], STEP_S)

    def smooth(value: Array) -> Array:
        return np.interp(grid, time, value)

    def held(name: str) -> Array:
        if name not in part:
            return np.zeros(len(grid))
        value = part[name]
        return value[np.clip(np.searchsorted(time, grid + 1e-6, side="right") - 1, 0, len(value) - 1)]

    psi = smooth(np.unwrap(part["heading"]))
    fixes = _from_fixes(part, grid) if not speeds and "fix_north" in part else None
    surge, sway, age = fixes or (*_from_speeds_or_places(part, psi, smooth, speeds), None)
    starboard = held("starboard") if "starboard" in part else held("port")
    return Stretch(
        source=source,
        start_s=float(time[0]),
        port=np.clip(held("port"), -1.0, 1.0),
        starboard=np.clip(starboard, -1.0, 1.0),
        rudder_rad=held("rudder"),
        psi_rad=psi,
        surge=surge,
        sway=sway,
        rate=smooth(part["yaw_rate"]),
        from_places=not speeds and fixes is None,
        age_s=age,
        track=_from_places(part, psi, smooth) if "surge" in part and fixes is None and _placed(part) else None,
    )


def _placed(part: dict[str, Array]) -> bool:
    """Whether every row tells where the vessel was."""
    return all(name in part and np.isfinite(part[name]).all() for name in ("lat", "lon"))


def _from_fixes(part: dict[str, Array], grid: Array) -> tuple[Array, Array, Array] | None:
    """Surge and sway of each fix and its age, at the step that follows it; elsewhere NaN. None where the record holds none."""
    time = part["time"]
    told = np.flatnonzero(np.isfinite(part["fix_north"] + part["fix_east"] + part["fix_age"]))
    at_s = time[told] - part["fix_age"][told]
    step = np.ceil((at_s - grid[0]) / STEP_S - 1e-6).astype(int)
    inside = (step >= 0) & (step < len(grid))
    if not inside.any():
        return None
    step, at_s, told = step[inside], at_s[inside], told[inside]
    psi = np.interp(at_s, time, np.unwrap(part["heading"]))
    north, east, cosine, sine = part["fix_north"][told], part["fix_east"][told], np.cos(psi), np.sin(psi)
    surge, sway, age = (np.full(len(grid), math.nan) for _ in range(3))
    surge[step], sway[step] = cosine * north + sine * east, cosine * east - sine * north
    age[step] = grid[step] - at_s
    return surge, sway, age


def _from_speeds_or_places(part: dict[str, Array], psi: Array, smooth: Any, speeds: bool) -> tuple[Array, Array]:
    if speeds:
        return smooth(part["surge"]), smooth(part["sway"])
    surge, sway = _from_places(part, psi, smooth)
    if "surge" in part and not np.any(np.isnan(part["surge"])):
        surge = smooth(part["surge"])
    return surge, sway


def _from_places(part: dict[str, Array], psi: Array, smooth: Any) -> tuple[Array, Array]:
    from scipy.signal import savgol_filter

    lat, lon = np.radians(part["lat"]), np.radians(part["lon"])
    per_lat, per_lon = metres_per_radian(float(lat[0]))
    north, east = smooth((lat - lat[0]) * per_lat), smooth(np.unwrap(lon - lon[0]) * per_lon)
    vn, ve = (savgol_filter(value, SMOOTH_STEPS, 2, deriv=1, delta=STEP_S) for value in (north, east))
    cosine, sine = np.cos(psi), np.sin(psi)
    return cosine * vn + sine * ve, cosine * ve - sine * vn
