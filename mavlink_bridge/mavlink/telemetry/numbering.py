"""Item numbers in the vessel's own texts, as the station counts them: a persona with a home item counts that as 0."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from ...language.requests import Reply
from ..persona import EndpointConfig

_ITEM: Final = re.compile(r"\b([Ii]tem) (\d+)")


def stations_text(text: str, config: EndpointConfig) -> str:
    """The vessel counts from 0 without home; return the text with this endpoint's numbers."""
    if not config.has_home_item:
        return text
    return _moved(text, 1)


def vessels_text(text: str) -> str:
    """A text of a vessel that counts its home item as 0, with the vessel's own numbers again."""
    return _moved(text, -1)


def named_text(text: str, name_of: Callable[[int], str]) -> str:
    """A text of a vessel that counts from 0, with names in place of its items' numbers."""
    return _ITEM.sub(lambda found: name_of(int(found[2])), text)


def _moved(text: str, by: int) -> str:
    return _ITEM.sub(lambda found: f"{found[1]} {max(int(found[2]) + by, 0)}", text)


def stations_numbers(reply: Reply, config: EndpointConfig) -> Reply:
    """The same for what an answer says."""
    return replace(reply, reason=stations_text(reply.reason, config)) if reply.reason else reply
