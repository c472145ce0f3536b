"""How a link is written in a configuration: ``scheme:where?key=value``, the seed's spellings included.

A mistake in it is the user's to mend, so it raises ``LinkConfigError`` with the mend; a device that is absent or
broken never raises anything anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import parse_qsl


class LinkConfigError(ValueError):
    """A link that cannot be meant as written. The text says what is wrong and how to write it."""


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A link's address, split. ``where`` is host:port, a path or a name; options are text, as written."""

    scheme: str
    where: str
    options: Mapping[str, str] = field(default_factory=dict)
    text: str = ""

    def host_port(self) -> tuple[str, int]:
        """Split ``where`` into host (empty = every interface) and port 1...65535 (0 = any free one)."""
        host, colon, port = self.where.rstrip("/").rpartition(":")
        if not colon or not port.isascii() or not port.isdigit() or not 0 <= int(port) <= 65535:
            raise LinkConfigError(f"{self.text}: needs a host and a port, like {self.scheme}://127.0.0.1:14550")
        if host.startswith("[") != host.endswith("]"):
            raise LinkConfigError(f"{self.text}: a bracket is missing; write {self.scheme}://[::1]:{port}")
        host = host.strip("[]")
        if any(char.isspace() for char in host):
            raise LinkConfigError(f"{self.text}: {host!r} can be no host's name: it has a space")
        try:
            host.encode("idna")  # as the look-up will do it
        except UnicodeError:
            raise LinkConfigError(
                f"{self.text}: {host} can be no host's name: each part between dots has 1 to 63 characters"
            ) from None
        return host, int(port)

    def path(self) -> str:
        """Return the path; empty is an error."""
        path = self.where.removeprefix("//") if self.where.startswith("///") else self.where
        if not path:
            raise LinkConfigError(f"{self.text}: needs a path, like {self.scheme}:/some/path")
        return path

    def number(self, key: str, default: float, low: float, high: float) -> float:
        """Read option ``key`` as a number in [low, high]."""
        raw = self.options.get(key)
        if raw is None:
            return default
        try:
            value = float(raw)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise LinkConfigError(f"{self.text}: {key}={raw} must be a number from {low:g} to {high:g}")
        return value

    def choice(self, key: str, default: str, allowed: Mapping[str, str]) -> str:
        """Read option ``key`` through a table of spellings."""
        raw = self.options.get(key, default)
        if raw.lower() not in allowed:
            raise LinkConfigError(f"{self.text}: {key}={raw} must be one of {', '.join(sorted(allowed))}")
        return allowed[raw.lower()]

    def allow(self, *keys: str) -> None:
        """Refuse options that this kind of link does not have."""
        strange = sorted(set(self.options) - set(keys))
        if strange:
            known = ", ".join(keys) or "none"
            raise LinkConfigError(f"{self.text}: no option {', '.join(strange)} here; known: {known}")


def parse_link_url(text: str, options: Mapping[str, object] | None = None) -> LinkUrl:
    """Split a link's text. ``options`` (a configuration's own keys) stand before those in the text."""
    text = text.strip()
    if text.startswith("/"):
        text = f"serial:{text}"
    scheme, colon, rest = text.partition(":")
    if not colon or not scheme:
        raise LinkConfigError(f"{text or 'an empty link'}: write scheme:where, like tcp://127.0.0.1:3000 or /dev/ttyS0")
    where, _, query = rest.partition("?")
    said = parse_qsl(query, keep_blank_values=True)
    found = dict(said)
    if len(found) < len(said):
        raise LinkConfigError(f"{text}: an option is said twice; leave out one of the two")
    found.update({key: str(value) for key, value in (options or {}).items() if value is not None})
    if where.startswith("//") and not where.startswith("///"):
        where = where[2:]
    return LinkUrl(scheme.lower(), where, found, text)
