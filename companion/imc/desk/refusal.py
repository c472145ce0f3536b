"""Why a plan is not sailed: the node's name and one reason, for the person who drew it."""

from __future__ import annotations


class ConsoleRefusedError(Exception):
    """``node``: name of the manoeuvre as the console shows it, "" for the plan as a whole."""

    def __init__(self, reason: str, node: str = "") -> None:
        super().__init__(f"{node}: {reason}" if node else reason)
        self.reason = reason
        self.node = node
