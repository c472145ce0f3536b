"""Key files: 32 raw bytes, readable by their owner only. A key that others may read is no key, nor is one of zeros."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
from pathlib import Path
from typing import Final

from ..log_file import make_own_folder, sync_folder

KEY_BYTES: Final = 32


class KeyFileError(ValueError):
    """A key file that cannot be used; the text says how to mend it."""


def read_key(path: Path) -> bytes:
    """Read a key. Raises KeyFileError when it is missing, has the wrong length, is all zeros, or is readable by others."""
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            key = file.read(KEY_BYTES + 1)
    except OSError as error:
        raise KeyFileError(
            f"{path}: {error.strerror or error}; make a key with 'companion keys make {path}', or copy the other side's"
        ) from error
    if len(key) != KEY_BYTES:
        found = f"{len(key)} bytes" if len(key) < KEY_BYTES else f"more than {KEY_BYTES} bytes"
        raise KeyFileError(f"{path}: {found}; a key has exactly {KEY_BYTES}. Copy the file again, or make a new one")
    if not any(key):
        raise KeyFileError(
            f"{path}: a key of zeros, which anybody can guess; make a new one with 'companion keys make'"
        )
    if mode & 0o077:
        raise KeyFileError(f"{path}: others on this computer may read it; chmod 600 {path}")
    return key


def write_key(path: Path, key: bytes, *, replace: bool = False) -> None:
    """Write a key so that nobody else can ever read it, whole or not at all. Raises KeyFileError."""
    if len(key) != KEY_BYTES:
        raise KeyFileError(f"a key has {KEY_BYTES} bytes, not {len(key)}")
    if not any(key):
        raise KeyFileError("a key of zeros, which anybody can guess, is not stored")
    if path.exists() and not replace:
        raise KeyFileError(
            f"{path}: there is a file already; give another name, or --replace (both sides need the new key)"
        )
    temporary = path.with_name(f".{path.name}.new")
    try:
        make_own_folder(path.parent)
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()
        fd = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(fd, "wb") as file:
            file.write(key)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        raise KeyFileError(f"{path}: {error.strerror or error}; choose a folder that can be written") from error


def from_passphrase(passphrase: str) -> bytes:
    """The key that ground stations make of a passphrase: its SHA-256 (as Mission Planner and MAVProxy do)."""
    return hashlib.sha256(passphrase.encode("utf-8")).digest()


def radio_key_from_passphrase(passphrase: str) -> bytes:
    """The radio's key of a passphrase: scrypt (RFC 7914) with 32 MB, because recorded radio frames test guesses off line.

    The salt is the same everywhere: both ends have nothing in common but the passphrase. So it must be a long one all the same.
    """
    return hashlib.scrypt(
        passphrase.encode("utf-8"), salt=b"usv-companion radio", n=1 << 15, r=8, p=1, maxmem=1 << 26, dklen=KEY_BYTES
    )


PAGE_ROUNDS: Final = 100_000
"""Rounds of the page's key: half a second on a desk, two on an old telephone, which reckons them in its browser."""
_PAGE_SALT: Final = b"usv-companion page"
_LETTERS: Final = "abcdefghjkmnpqrstuvwxyz23456789"
"""Letters that nobody mistakes for another on a telephone."""


def page_key_from_passphrase(passphrase: str) -> bytes:
    """The page's key of a passphrase: PBKDF2 with HMAC-SHA-256 (RFC 8018), because a browser on plain http has nothing else."""
    return hashlib.pbkdf2_hmac("sha256", passphrase.strip().encode("utf-8"), _PAGE_SALT, PAGE_ROUNDS, KEY_BYTES)


def new_page_passphrase() -> str:
    """Five groups of four letters, 99 bits: to be typed once on a telephone."""
    return "-".join("".join(secrets.choice(_LETTERS) for _ in range(4)) for _ in range(5))


def fingerprint(key: bytes) -> str:
    """Eight characters by which people can compare two copies without showing the key."""
    return hashlib.sha256(b"fingerprint" + key).hexdigest()[:8]
