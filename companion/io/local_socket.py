"""A stream socket between programs of one account on this computer: a file that nobody else may open, served without waiting.

Both ends are bounded. A served peer that does not read keeps the rest of one message and is told nothing newer until it has taken that.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from .log_file import make_own_folder

PEERS_MAX: Final = 8
"""Terminals and the page's server; each new one costs the vessel a message every quarter of a second."""
_SEND_BUFFER: Final = 8192
"""What the kernel keeps for one peer: two or three messages, so that a slow one is shown nothing old for long."""
_READ_BYTES: Final = 4096
LINE_MAX: Final = 2048
"""The longest line that a peer may send."""
_ACCEPTS: Final = 4
"""Newcomers taken in one look."""


class LocalPeer:
    """One who has come. ``lines`` gives what it says, ``send`` takes a message when the one before is out."""

    def __init__(self, stream: socket.socket) -> None:
        self._stream = stream
        self._waiting = b""
        self._heard = b""
        self.is_gone = False

    def fileno(self) -> int:
        return self._stream.fileno()

    @property
    def is_free(self) -> bool:
        """Whether the last message is out; tries to get it out."""
        self._push()
        return not self._waiting and not self.is_gone

    def send(self, data: bytes) -> bool:
        """Take a whole message, or nothing: False while one before it is still under way."""
        if not self.is_free:
            return False
        self._waiting = data
        self._push()
        return True

    def lines(self) -> Iterator[bytes]:
        """Whole lines since the last look, at most what one read brings. A line that is too long ends the connection."""
        if self.is_gone:
            return
        try:
            data = self._stream.recv(_READ_BYTES)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        *whole, self._heard = (self._heard + data).split(b"\n")
        if len(self._heard) > LINE_MAX or any(len(line) > LINE_MAX for line in whole):
            self.close()
            return
        yield from whole

    def close(self) -> None:
        self.is_gone = True
        self._waiting = self._heard = b""
        self._stream.close()

    def _push(self) -> None:
        if not self._waiting or self.is_gone:
            return
        try:
            sent = self._stream.send(self._waiting, socket.MSG_NOSIGNAL)
            self._waiting = self._waiting[sent:]
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            self.close()


class LocalServer:
    """Serves a socket at ``path``, readable by its owner only. Raises OSError when it cannot, or somebody serves there already."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.peers: list[LocalPeer] = []
        make_own_folder(path.parent)
        with _place(path) as place:
            _clear(place, path)
            self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
            before = os.umask(0o177)
            try:
                self._listener.bind(place)
            except OSError:
                self._listener.close()
                raise
            finally:
                os.umask(before)
        self._own = path.stat().st_ino
        self._listener.listen(PEERS_MAX)

    def look(self) -> list[LocalPeer]:
        """Take newcomers in, forget who has gone, and return who is there."""
        if any(peer.is_gone for peer in self.peers):
            self.peers = [peer for peer in self.peers if not peer.is_gone]
        for _ in range(_ACCEPTS):
            try:
                stream, _ = self._listener.accept()
            except OSError:
                break
            stream.setblocking(False)
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
            if len(self.peers) >= PEERS_MAX:
                stream.close()
            else:
                self.peers.append(LocalPeer(stream))
        return self.peers

    def close(self) -> None:
        """End all connections; the file goes too, unless another has taken its place."""
        for peer in self.peers:
            peer.close()
        self.peers = []
        self._listener.close()
        with contextlib.suppress(OSError):
            if self.path.stat().st_ino == self._own:
                self.path.unlink()


def connect(path: Path, timeout_s: float) -> socket.socket:
    """Reach the server at ``path``; reads and writes then wait ``timeout_s`` at most. Raises OSError."""
    stream = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    stream.settimeout(timeout_s)
    try:
        with _place(path) as place:
            stream.connect(place)
    except OSError:
        stream.close()
        raise
    return stream


@contextlib.contextmanager
def _place(path: Path) -> Iterator[str]:
    """The path in a form that fits: a socket's address holds 107 bytes, however deep the folder lies."""
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)


def _clear(place: str, path: Path) -> None:
    """Take away what a killed process left. Raises OSError when it is alive, or is no socket."""
    try:
        kind = os.lstat(place).st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(kind):
        raise FileExistsError(errno.EEXIST, "there is a file that is no socket", str(path))
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(place)
        except ConnectionRefusedError:
            Path(place).unlink()
            return
        except BlockingIOError:
            pass
    raise OSError(errno.EADDRINUSE, "another vessel's process serves here", str(path))
