"""Whether steering gains fit together and fit the vessel: refused before they reach the water (fault row 59).

Each gain alone has a range; together they may still leave a loop no margin. Both loops of the law ``model`` are judged
behind the actuators' lag and the stated delay, with the settings as they are: what the schedule mends is no excuse for settings
that fit no hull. Where the shipped settings would not do either it is the hull, unstable by itself, or its file, and the gains that
the schedule mends for it are judged. A law with free gains (``seed``, one's own) is not judged here; the oscillation monitor
watches all of them.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Final

from ..hull import ForceModel, VesselConfig
from ..hull.statics import drag_n
from .law import SteeringConfig
from .model import ModelController
from .yaw_loop import DELAY_S, LoopMargins

PHASE_DEG: Final = 20.0
GAIN_DB: Final = 4.0
"""Less than either, and the loop oscillates on a boat that is a little different from its file."""
_FREQUENCIES: Final = tuple(0.03 * 1.06**k for k in range(120))
_SPEEDS: Final = (0.0, 0.5, 1.0)
"""Shares of the greatest speed at which the heading loop is looked at."""

Loop = Callable[[complex], complex]


def gains_problem(config: SteeringConfig, vessel: VesselConfig) -> str:
    """Why these gains must not steer this vessel, in a sentence; empty when they may."""
    if config.profile != "model":
        return ""
    model = config.model
    found = _worst_plain(config, vessel)
    if not _will_do(found) and not _will_do(_worst_plain(SteeringConfig(), vessel)):
        found = ModelController(config, vessel).schedule.worst.margins
    if not _will_do(found):
        names = f"STEER_BW {model.heading_bandwidth:g}, STEER_ZETA {model.heading_damping:g}, STEER_INT {model.heading_integral:g}"
        return _told(f"heading loop ({names})", found.gain_db, found.phase_deg)
    gain = model.speed_gain
    damping = drag_n(vessel, 0.5) / 0.5 / vessel.hull.m11_kg
    loop = _speed(gain, gain * model.speed_integral, damping, vessel.thruster.lag_s)
    return _problem(loop, f"speed loop (SPEED_P {gain:g}, SPEED_I {model.speed_integral:g})")


def _worst_plain(config: SteeringConfig, vessel: VesselConfig) -> LoopMargins:
    """What the settings' own damping and integral leave at the speed where that is least."""
    controller = ModelController(config, vessel)
    shares = _SPEEDS if ForceModel(vessel).turns_at_rest else _SPEEDS[1:]
    found = [controller.plain_margins(share * controller.schedule.steady_mps) for share in shares]
    return min(found, key=lambda margins: min(margins.gain_db / GAIN_DB, margins.phase_deg / PHASE_DEG))


def _will_do(found: LoopMargins) -> bool:
    return found.gain_db >= GAIN_DB and found.phase_deg >= PHASE_DEG


def _speed(gain: float, integral: float, damping: float, lag_s: float) -> Loop:
    def loop(s: complex) -> complex:
        return (gain + integral / s) / (s + damping) / (1.0 + s * lag_s) * cmath.exp(-s * DELAY_S)

    return loop


def _problem(loop: Loop, name: str) -> str:
    gain_db, phase_deg = margins(loop)
    if gain_db >= GAIN_DB and phase_deg >= PHASE_DEG:
        return ""
    return _told(name, gain_db, phase_deg)


def _told(name: str, gain_db: float, phase_deg: float) -> str:
    return f"the {name} would be unstable or nearly so: margins {gain_db:.0f} dB and {phase_deg:.0f} degrees"


def margins(loop: Loop) -> tuple[float, float]:
    """Least gain margin in dB and phase margin in degrees of an open loop; infinite where there is no crossing."""
    gain_db = phase_deg = math.inf
    last_size, last_phase = math.inf, 0.0
    for omega in _FREQUENCIES:
        answer = loop(complex(0.0, omega))
        size, phase = abs(answer), cmath.phase(answer)
        while phase > last_phase + math.pi:
            phase -= 2.0 * math.pi
        if last_size > 1.0 >= size:
            share = math.log(last_size) / math.log(last_size / size) if last_size < math.inf else 1.0
            phase_deg = min(phase_deg, math.degrees(last_phase + share * (phase - last_phase) + math.pi))
        if last_phase > -math.pi >= phase:
            share = (last_phase + math.pi) / (last_phase - phase) if last_size < math.inf else 1.0
            gain_db = min(
                gain_db, -20.0 * math.log10(last_size ** (1.0 - share) * size**share if share < 1.0 else size)
            )
        last_size, last_phase = size, phase
    return gain_db, phase_deg
