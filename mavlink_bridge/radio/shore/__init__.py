"""The shore's twin of the vessel: it answers locally and is honest about age."""

from __future__ import annotations

from .twin import ShoreTwin

__all__ = ["ShoreTwin"]
