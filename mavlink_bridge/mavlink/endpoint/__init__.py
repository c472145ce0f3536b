"""One conversation: a link's ground stations in, the vessel's requests out."""

from __future__ import annotations

from .endpoint import Endpoint

__all__ = ["Endpoint"]
