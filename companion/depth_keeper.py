"""Keeps the depth memory in the store: takes it back at the start, hands on what is new every few seconds.

The tick only copies the tiles that changed; packing and writing are the store writer's. What could not be written is
handed on again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from mavlink_bridge.language.requests import Reply, Result

from .core.board.wire import Version
from .core.guard.depth.memory import DepthMemory, DepthMemoryConfig
from .core.guard.depth.tiles import TileKey
from .io.keeping import StoreOp
from .io.keeping.content import SaveDepth
from .io.keeping.depth_store import join_key, restore
from .io.keeping.mark import WorldKind

Keep = Callable[[StoreOp, Callable[[Reply], None]], None]
"""Stores a change and answers when it is done."""
Tell = Callable[[str], None]
"""Warns every operator."""
_TILES_AT_ONCE: Final = 64
_SIMULATED_BOARD: Final = "TWIN"
"""The name that the simulator's board tells; no firmware has it."""


class DepthKeeper:
    """Between a vessel's depth memory (None: there is none) and its store."""

    def __init__(
        self, memory: DepthMemory | None, config: DepthMemoryConfig, keep: Keep, tell: Tell = lambda text: None
    ) -> None:
        self._memory = memory
        self._keep = keep
        self._tell = tell
        self._told_full = False
        self._is_real = False
        self._save_us = round(config.save_s * 1e6)
        self._cell_m = config.cell_m
        self._busy = False
        self.due_us = 0
        """When ``save`` is due."""

    def restore(self, tiles: Mapping[str, str], world: str | None = None) -> list[str]:
        """Take the store's tiles, and the kind of its world; return what to tell of it."""
        self._is_real = world == WorldKind.REAL
        memory = self._memory
        if memory is None or not tiles:
            return []
        damaged = restore(memory, tiles)
        texts = [f"Depth memory: {len(memory)} tiles of earlier voyages"] if len(memory) else []
        if damaged:
            texts.append(f"Depth memory: {damaged} tiles are damaged and left out")
        if others := len(tiles) - damaged - len(memory):
            texts.append(f"Depth memory: {others} tiles of another cell size are not used (depth.memory.cell_m)")
        return texts

    def heed_board(self, version: Version | None) -> None:
        """Take what the actuator board says it is: a boat with a simulator's sounds a sea that is not there, and no real store keeps it."""
        if version is None or version.board != _SIMULATED_BOARD or not self._is_real:
            return
        self._is_real, self._memory = False, None
        self._tell("SIMULATED BOARD on a real boat's store: start with --simulated. Soundings are not kept")

    def save(self, now_us: int) -> None:
        """Hand on what is new; call when it is due. One save at a time: a disk that hangs must not fill the memory."""
        self.due_us = now_us + self._save_us
        memory = self._memory
        if memory is None or self._busy:
            return
        if memory.forgotten and not self._told_full:
            self._told_full = True
            self._tell(f"Depth memory is full ({len(memory)} tiles): the oldest go. Raise depth.memory.tiles_max")
        changed, gone = memory.take_changes(_TILES_AT_ONCE)
        if not changed and not gone:
            return
        op = SaveDepth(tuple((self._key(key), tile) for key, tile in changed), tuple(map(self._key, gone)))

        def answer(reply: Reply) -> None:
            self._busy = False
            if reply.result is not Result.ACCEPTED:
                memory.put_back([key for key, _ in changed], gone)

        self._busy = True
        self._keep(op, answer)

    def close(self, now_us: int) -> None:
        """Hand on the rest, at the end of a run: all of it, however much a disk in trouble has left."""
        memory = self._memory
        if memory is None:
            return
        memory.close_cell()
        for _ in range(1 + memory.waiting // _TILES_AT_ONCE):
            self._busy = False
            self.save(now_us)

    def _key(self, place: TileKey) -> str:
        return join_key(self._cell_m, place)
