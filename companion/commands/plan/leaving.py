"""How the command line leaves a vessel: it says what an armed one does without a station, and gives command back."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Final

from mavlink_bridge.language.messages import Action

from ...core.guard.failsafe_config import FailsafeConfig, Rule
from ...core.vehicle.config import OperatorConfig
from ...settings.params import entries
from .link import LinkError, Vessel

HOLDS: Final = "holds"
SAILS: Final = "sails on"
_ROW: Final = "gcs_lost"
_BEGINS: Final = "gcs_"
"""How the settings of that row, and the one that switches it, begin."""
_DOES: Final = {Action.HOLD: HOLDS, Action.RETURN: "returns", Action.STOP: "stops"}
"""By what it does without a station; a warning that nobody hears is none."""
_MEND: Final = "keep a station, or disarm it: companion plan disarm"


def leave(vessel: Vessel, doing: str, mend: str = _MEND) -> None:
    """Say of an armed vessel that it is, and what follows; then give command back. ``doing``: HOLDS or SAILS."""
    if vessel.is_armed:
        told = f"the vessel is armed and {doing}; without a ground station it {_alone(vessel, doing)}: {mend}"
        print(told, file=sys.stderr, flush=True)
    vessel.hand_over()


def _alone(vessel: Vessel, doing: str) -> str:
    """What its settings make it do, and when."""
    try:
        row = _row(vessel)
    except (LinkError, ValueError):
        return "may set off for home"
    told = [f"{what} within {after_s:.0f} s" for what, after_s in _acts(row) if what != doing] if row else []
    return " and ".join(told) or "goes on so"


def _row(vessel: Vessel) -> Rule | None:
    """The failsafe for a lost station, as the vessel has it set; None: it wants no station. Raises LinkError, ValueError."""
    told = {
        entry.path[0]: float(vessel.setting(entry.param.name))
        for model in (OperatorConfig, FailsafeConfig)
        for entry in entries(model)
        if entry.path[0].startswith(_BEGINS)
    }
    needs = OperatorConfig.model_validate({key: told.pop(key) for key in OperatorConfig.model_fields if key in told})
    rules = FailsafeConfig.model_validate(told).rules
    return next(rule for rule in rules if rule.row.name == _ROW) if needs.gcs_required else None


def _acts(row: Rule) -> Iterator[tuple[str, float]]:
    """What it does, and how long after the last word of a station."""
    if row.action in _DOES:
        yield _DOES[row.action], row.delay_us * 1e-6
    if row.then_us is not None and row.then_action in _DOES:
        yield _DOES[row.then_action], (row.delay_us + row.then_us) * 1e-6
