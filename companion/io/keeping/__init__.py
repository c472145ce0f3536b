"""What must outlive the process: the store, its file and its content, the depth memory in it, and key files."""

from __future__ import annotations

from .content import Completion, StoreContent, StoreOp
from .store import AnyStore, MemoryStore, Store

__all__ = ["AnyStore", "Completion", "MemoryStore", "Store", "StoreContent", "StoreOp"]
