"""Numbers as words of a command line: finite and within their range, or refused before anything is done."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def number(low: float = -math.inf, high: float = math.inf) -> Callable[[str], float]:
    """What reads a finite number from ``low`` to ``high``, both included."""
    return lambda text: _read(text, low, high, _range(low, high))


def whole(low: int | None = None, high: int | None = None) -> Callable[[str], int]:
    """What reads a whole number from ``low`` to ``high``, both included."""
    return lambda text: _read_whole(text, low, high)


def positive(text: str) -> float:
    """Read a finite number greater than 0: seconds, metres, metres per second."""
    return _read(text, math.ulp(0.0), math.inf, "a number greater than 0")


def _read(text: str, low: float, high: float, wanted: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and low <= value <= high):
        raise argparse.ArgumentTypeError(f"{text}: give {wanted}")
    return value


def _read_whole(text: str, low: int | None, high: int | None) -> int:
    least, most = -math.inf if low is None else low, math.inf if high is None else high
    try:
        value = int(text)
        is_within = least <= value <= most
    except ValueError:
        is_within = False
    if not is_within:
        raise argparse.ArgumentTypeError(f"{text}: give {_range(least, most).replace('a number', 'a whole number')}")
    return value


def _range(low: float, high: float) -> str:
    if high < math.inf:
        return f"a number from {low:g} to {high:g}"
    return f"a number of at least {low:g}" if low > -math.inf else "a number"
