"""The tiles of the depth memory, in the order in which they were sailed over: some as they are, the others packed.

A store may hold many more tiles than the vessel has room for unpacked. A packed one is a tenth as large and is unpacked for
whoever asks: nothing that is known of the way ahead is left out for want of room.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from itertools import chain

from .tiles import TileKey


class TileShelf:
    """Keeps every tile that is put on it. ``open_max``: so many lie unpacked, the ones that were changed last."""

    def __init__(self, open_max: int) -> None:
        self._open_max = open_max
        self._order: dict[TileKey, None] = {}
        """Sailed over longest ago first."""
        self._undated: dict[TileKey, None] = {}
        """Never sailed over, as far as is known: what an import brought, the first to go first."""
        self._open: dict[TileKey, bytearray] = {}
        self._packed: dict[TileKey, bytes] = {}

    def __len__(self) -> int:
        return len(self._order) + len(self._undated)

    def __contains__(self, key: TileKey) -> bool:
        return key in self._order or key in self._undated

    def __iter__(self) -> Iterator[TileKey]:
        """Keys in the order in which they are to go: those sailed over longest ago first, those without a date last."""
        return chain(self._order, self._undated)

    def first_to_go(self, room: int) -> TileKey:
        """The tile sailed over longest ago; one without a date only where fewer than ``room`` have been sailed over."""
        is_short = len(self._order) < room
        return next(chain(self._undated, self._order) if is_short else iter(self))

    def look(self, key: TileKey) -> bytes | bytearray:
        """A tile to be read."""
        packed = self._packed.get(key)
        return self._open[key] if packed is None else zlib.decompress(packed)

    def sailed_over(self, key: TileKey) -> bytearray | None:
        """A tile to be changed, the newest of all from now on; None = there is none."""
        if key not in self:
            return None
        tile = bytearray(self.look(key))
        self.remove(key)
        self.put(key, tile)
        return tile

    def opened(self, key: TileKey) -> bytearray | None:
        """The same of one that is in its place in the order already."""
        return self._open.get(key) or self.sailed_over(key)

    def put(self, key: TileKey, tile: bytearray) -> None:
        """Add a tile, the newest of all."""
        while len(self._open) >= self._open_max:
            least = next(iter(self._open))
            self._packed[least] = zlib.compress(self._open.pop(least), 1)
        self._order[key] = None
        self._open[key] = tile

    def remove(self, key: TileKey) -> None:
        del (self._order if key in self._order else self._undated)[key]
        self._open.pop(key, None)
        self._packed.pop(key, None)

    def put_in_order(self, sailed_over: Iterable[TileKey], undated: Iterable[TileKey]) -> None:
        """Say anew in which order all tiles were sailed over, and in which those go that were not."""
        self._order, self._undated = dict.fromkeys(sailed_over), dict.fromkeys(undated)
