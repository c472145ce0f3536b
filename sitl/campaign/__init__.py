"""Campaigns: scenarios by seeds by vessels over all cores or a cluster, and the page that shows them."""

from __future__ import annotations

from .campaign import read_campaign, run_campaign
from .page import make_page

__all__ = ["make_page", "read_campaign", "run_campaign"]
