"""The states of the guard and the table of its transitions (vessel-control §5.2)."""

from __future__ import annotations

from typing import Final

from mavlink_bridge.language.messages import GuardState

EPS_M: Final = 1e-9
"""Sums of floats at the limit are equal to it within this."""

UNKNOWN, OK, CORRECTION, LOCKED = GuardState.UNKNOWN, GuardState.OK, GuardState.CORRECTION, GuardState.LOCKED


def next_state(
    state: GuardState, altitude_m: float | None, min_m: float, minimum_margin_m: float, good_margin_m: float
) -> GuardState:
    """One transition of the guard's table (vessel-control §5.2; unknown: architecture-study §4.8). Pure.

    "Below" is strict, "good" includes equality; both within 1e-9 m, so that decimal thresholds behave.
    """
    if altitude_m is None:
        return LOCKED if state is LOCKED else UNKNOWN
    if altitude_m >= min_m + good_margin_m - EPS_M:
        return OK
    if state is LOCKED or altitude_m < min_m - minimum_margin_m - EPS_M:
        return LOCKED
    if state is OK and altitude_m >= min_m - EPS_M:
        return OK
    return CORRECTION
