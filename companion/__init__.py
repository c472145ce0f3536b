"""The vessel: decisions in ``core``, devices in ``io``, one composition root in ``app``.

On PyPy one function of the standard library is made to round as CPython's does, before anything reckons with it: a
recording replays bit for bit on either.
"""

import math
import sys
from typing import SupportsFloat, SupportsIndex

if sys.implementation.name == "pypy":  # divides by pi / 180 where CPython multiplies by 180 / pi

    def _degrees(angle_rad: SupportsFloat | SupportsIndex, /) -> float:
        return float(angle_rad) * (180.0 / math.pi)

    math.degrees = _degrees
