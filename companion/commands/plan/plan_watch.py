"""Staying with a plan that is being sailed: where it stands is shown, by what the vessel says of it, until it is complete."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from mavlink_bridge.language.messages import PlanState

from ...status.words import item_words

MISSION_CURRENT: Final = "MISSION_CURRENT"
_NO_TOTAL: Final = 0xFFFF


class PlanWatch:
    """One plan's. MAVSDK's own count of items is that of its last upload, and nothing where another program sent the plan."""

    def __init__(self, *, home_item: bool) -> None:
        """``home_item``: the vessel counts home as item 0; here it is left out, as in files and in the vessel's own texts."""
        self._home = int(home_item)
        self._shown = ""
        self._was_under_way = False
        self.is_over = False
        self.knows_no_state = True
        """The vessel does not say how its plan stands: not all do."""

    def take(self, fields: Mapping[str, Any]) -> None:
        """A MISSION_CURRENT came. What is complete before it was seen under way is the plan that was sailed before."""
        state = int(fields.get("mission_state", 0))
        self.knows_no_state = state == 0
        self._was_under_way |= state == PlanState.ACTIVE
        self.is_over = self._was_under_way and state == PlanState.COMPLETE
        total = int(fields.get("total", _NO_TOTAL))
        if state == PlanState.COMPLETE or total in (0, _NO_TOTAL):
            return
        words = item_words(max(int(fields["seq"]) - self._home, 0), total)
        if words != self._shown:
            self._shown = words
            print(words, flush=True)
