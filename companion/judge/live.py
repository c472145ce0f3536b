"""A setting that is changed while the program runs, held against what its file is held against: the program would not start with it.

Judged is what the change brings, not what the file holds already, and only what the changed key itself is told of: of two that are
changed one after the other the first must not be refused for the second. What that leaves wrong is told. No disk and no line is looked
at: a tick waits for it.
"""

from __future__ import annotations

from ..core.hull import VesselConfig
from ..settings import Settings
from .meaning import plain_meaning
from .thresholds import pulse_mistakes


def change_mistakes(before: Settings, after: Settings, vessel: VesselConfig, said: str) -> list[str]:
    """What a file with this change would be refused for.

    ``before``: the same settings with the old value written anew. ``said``: how a mistake of the changed key begins.
    """
    known = {text for text in plain_meaning(before, vessel) if text.startswith(said)}
    found = [text for text in plain_meaning(after, vessel) if text.startswith(said) and text not in known]
    return found if any(pulse_mistakes(before)) else [*found, *pulse_mistakes(after)]


def left_to_mend(before: Settings, after: Settings, vessel: VesselConfig, said: str) -> list[str]:
    """What this change makes wrong of other keys, by which a file with both would be refused: the second change may mend it."""
    known = {text for text in plain_meaning(before, vessel) if not text.startswith(said)}
    return [text for text in plain_meaning(after, vessel) if not text.startswith(said) and text not in known]
