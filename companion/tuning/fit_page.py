"""The page of a fit: measured and modelled on the same axes, steady speeds, turning circles, ways to rest, residuals. One file."""

from __future__ import annotations

import html
import io
import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from ..core.hull import Handling, VesselConfig
from ..core.hull.statics import Statics
from .fit import Fit
from .fitted import PLACES, Gains, care, doubt, interval, strayed
from .seed_fit import SeedGains

_STYLE: Final = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:1040px;margin:0 auto;padding:24px 16px}svg{width:100%;height:auto}"
    "table,pre{display:block;overflow-x:auto}"
    "table{border-collapse:collapse}td,th{padding:3px 14px 3px 0;text-align:left;border-bottom:1px solid #ddd}"
)
_PHONE: Final = "<meta name=viewport content='width=device-width,initial-scale=1'>"
_OUTPUTS: Final = ("surge, m/s", "sway, m/s", "yaw rate, deg/s")
_SELDOM: Final = 0.5
_SHOWN: Final = 4
"""Stretches that are drawn."""
_OF_RECORD: Final = {"_late": "s", "_smooth": "s", "heading_offset": "deg", "sensor_forward": "m", "wind_": "m/s"}
"""Units of what belongs to the record and not to the boat, by a part of the name."""
_WIDE: Final = 4.0
"""Of the circle at half speed: near the top speed no thrust is left to turn with, and circles without end would leave nothing to see."""


def page(
    fit: Fit,
    new: VesselConfig,
    rows: Sequence[tuple[str, str, str]],
    *,
    gains: Gains,
    seed: SeedGains | None,
    source: str,
) -> str:
    """Return the page as HTML with drawings inside. ``seed``: gains of the seed's law, None where none hold."""
    drawings: list[tuple[str, Callable[[Any], None]]] = [
        (
            "Stretches kept apart: measured (black), modelled by the fitted file (blue), by the file before (grey)",
            lambda f: _sails(f, fit),
        ),
        (
            "Steady speed over throttle, turning radius and way to rest: before (grey), fitted (blue)",
            lambda f: _curves(f, fit, new),
        ),
        ("Residuals on the stretches kept apart", lambda f: _residuals(f, fit)),
    ]
    body = [f"<h1>{html.escape(new.name)}</h1><p>Fitted to {html.escape(source)}.</p>"]
    if text := doubt(fit) or care(fit):
        body.append(f"<p><b>{html.escape(text)}.</b></p>")
    if text := strayed(fit):
        body.append(f"<p>{html.escape(text)}</p>")
    body.append(_table(("", "before", "fitted"), rows))
    body += [f"<h2>{html.escape(title)}</h2>{_svg(draw)}" for title, draw in drawings]
    body.append("<h2>Coefficients</h2>" + _table(("", "value", "95 %", ""), [_told(fit, name) for name in fit.values]))
    if fit.untold:
        body.append(f"<p>Not told by the record, left as they were: {', '.join(u.name for u in fit.untold)}.</p>")
    body.append(f"<h2>Margins of the heading loop, STEER_BW {gains.bandwidth:.2f}</h2>{_margins(gains)}")
    body.append(f"<h2>Gains of the model law</h2>{_gains(gains)}")
    body.append(f"<h2>Gains of the seed's law</h2>{_seed(seed)}")
    return f"<!doctype html><meta charset=utf-8>{_PHONE}<title>{html.escape(new.name)}</title><style>{_STYLE}</style>{''.join(body)}"


def _told(fit: Fit, name: str) -> tuple[str, str, str, str]:
    """Name, value, interval and unit; angles in degrees, as in the file."""
    unit = PLACES[name][2] if name in PLACES else next((unit for part, unit in _OF_RECORD.items() if part in name), "")
    scale = math.degrees(1.0) if unit == "deg" else 1.0
    low, high = (scale * end for end in interval(name, fit))
    return name, f"{scale * fit.values[name]:.4g}", f"{low:.4g} to {high:.4g}", unit


def _margins(found: Gains | SeedGains) -> str:
    """Margins over speed, of the fitted file and at the worst corner."""
    shown = [
        (
            f"{speed:.1f} m/s",
            f"{best.gain_db:.1f} dB, {best.phase_deg:.0f}°",
            f"{worst.gain_db:.1f} dB, {worst.phase_deg:.0f}°",
        )
        for speed, best, worst in zip(found.speeds, found.best, found.worst, strict=True)
    ]
    return _table(("", "fitted file", "worst corner of what is known"), shown)


def _gains(gains: Gains) -> str:
    shown = [
        (f"{speed:.1f} m/s", *(f"{gain:.4g}" for gain in each))
        for speed, each in zip(gains.speeds, gains.gains, strict=True)
    ]
    return _table(("", "P, Nm/rad", "I, Nm/(rad s)", "D, Nm/(rad/s)"), shown)


def _seed(seed: SeedGains | None) -> str:
    if seed is None:
        return "<p>None on the grid hold 8 dB and 45° at the worst corner at any speed.</p>"
    return f"<pre>{html.escape(seed.toml)}</pre>{_margins(seed)}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(text)}</th>" for text in heads)
    lines = "".join("<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{lines}</table>"


def _svg(draw: Callable[[Any], None]) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5), layout="tight")
    draw(figure)
    text = io.StringIO()
    figure.savefig(text, format="svg")
    return text.getvalue().partition("<svg")[1] + text.getvalue().partition("<svg")[2]


def _sails(figure: Any, fit: Fit) -> None:
    data = fit.samples
    windows = min(_SHOWN, data["times"].shape[1])
    axes = figure.subplots(3, windows, squeeze=False)
    for k in range(windows):
        for part, name in enumerate(_OUTPUTS):
            scale = math.degrees(1.0) if part == 2 else 1.0
            at = axes[part][k]
            for kind, colour in (("before", "0.7"), ("modelled", "tab:blue"), ("measured", "black")):
                value = data[kind][:, part, k]
                heard = np.isfinite(value)
                # what a slow receiver told are points: nobody knows what lay between
                line = "-" if heard.mean() > _SELDOM else "."
                at.plot(data["times"][heard, k], scale * value[heard], line, color=colour, linewidth=1)
            if k == 0:
                at.set_ylabel(name)
    for at in axes[2]:
        at.set_xlabel("s")


def _curves(figure: Any, fit: Fit, new: VesselConfig) -> None:
    speed, radius, way = figure.subplots(1, 3)
    throttles, widest_m = np.linspace(0.05, 1.0, 20), 0.0
    for vessel, colour in ((fit.vessel, "0.6"), (new, "tab:blue")):
        statics, handling = Statics(vessel), Handling(vessel)
        speed.plot(100 * throttles, [statics.throttle_to_speed(float(c)) for c in throttles], color=colour)
        speeds = np.linspace(0.2, statics.top_mps, 20)
        radius.plot(speeds, [handling.turn_radius_m(float(u)) for u in speeds], color=colour)
        widest_m = max(widest_m, _WIDE * handling.turn_radius_m(0.5 * statics.top_mps))
        way.plot(speeds, [statics.stopping_distance_m(float(u)) for u in speeds], color=colour)
    radius.set_ylim(0.0, widest_m)
    for at, x, y in (
        (speed, "throttle, %", "speed, m/s"),
        (radius, "m/s", "tightest circle, m"),
        (way, "m/s", "way to rest, m"),
    ):
        at.set_xlabel(x)
        at.set_ylabel(y)
        at.grid(alpha=0.3)


def _residuals(figure: Any, fit: Fit) -> None:
    data = fit.samples
    for part, (at, name) in enumerate(zip(figure.subplots(1, 3), _OUTPUTS, strict=True)):
        scale = math.degrees(1.0) if part == 2 else 1.0
        off = (data["modelled"][:, part] - data["measured"][:, part]).ravel()
        at.hist(scale * off[np.isfinite(off)], bins=60, color="tab:blue")
        at.set_xlabel(name)
