"""What a key proves and makes, said in the recording's terms: the outcome is an input of the program, the key never is.

Whoever uses a key asks a witness: ``verdict`` for each yes or no of a signature or tag, ``made`` for each signature, tag or random
number. Live they are reckoned; a recording writes the outcome down as well; a replay has no key and says what was written down, so
that it checks plain texts and verdicts, and no cryptography.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

PLACEHOLDER: Final = b"no key: a replay's placeholder.."
"""32 bytes that stand in a replay where a key is wanted. They guard nothing."""


class Witness:
    """Live: reckons and remembers nothing."""

    placeholder: bytes | None = None
    """What stands in for every key, when there are none: key files are then neither read nor written."""

    def verdict(self, check: Callable[[], bool]) -> bool:
        """Whether ``check``, which uses a key, is true."""
        return check()

    def made(self, make: Callable[[], bytes]) -> bytes:
        """What ``make`` makes with a key or at random."""
        return make()
