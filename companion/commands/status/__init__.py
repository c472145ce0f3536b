"""The vessel's state for people without a ground station: a panel on the terminal, plain lines in a pipe, the service's journal."""

from .journal import Journal, LinkNotes
from .panel import line, panel
from .view import SnapshotView, StatusView, Views, Watched, airtime_of

__all__ = ["Journal", "LinkNotes", "SnapshotView", "StatusView", "Views", "Watched", "airtime_of", "line", "panel"]
