"""The page itself: one document with its style and script inside, put together once and packed small."""

from __future__ import annotations

import base64
import gzip
import hashlib
from dataclasses import dataclass
from importlib import resources
from typing import Final

from .http import HttpAnswer

_SCRIPTS: Final = ("sha256.js", "map.js", "page.js")
_REPORT_RULES: Final = (
    "sandbox allow-scripts; default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "frame-ancestors 'none'"
)
"""A report may run its own script and reach nothing: not the page, not its key."""


@dataclass(frozen=True, slots=True)
class Page:
    """The document, packed (RFC 1952) and plain, and what a browser may do with it."""

    packed: HttpAnswer
    plain: HttpAnswer

    def answer(self, accepts: str) -> HttpAnswer:
        """The document for a browser that accepts these encodings."""
        return self.packed if "gzip" in accepts else self.plain


def read_file(name: str) -> str:
    """One of the page's own files."""
    return resources.files(__package__).joinpath("page", name).read_text(encoding="utf-8")


def build() -> Page:
    """Put the page together."""
    style, script = read_file("page.css"), "\n".join(map(read_file, _SCRIPTS))
    body = read_file("page.html").replace("/*STYLE*/", style).replace("/*SCRIPT*/", script).encode()
    rules = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; connect-src 'self'; img-src data:; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    kind, headers = "text/html; charset=utf-8", {"Content-Security-Policy": rules, "Vary": "Accept-Encoding"}
    packed = HttpAnswer(
        kind=kind, body=gzip.compress(body, 9, mtime=0), headers={**headers, "Content-Encoding": "gzip"}
    )
    return Page(packed, HttpAnswer(kind=kind, body=body, headers=headers))


def file_answer(name: str) -> HttpAnswer:
    """What is said before a run's file: a report is shown, all else is kept by the browser as a file."""
    if name.endswith(".html"):
        return HttpAnswer(kind="text/html; charset=utf-8", headers={"Content-Security-Policy": _REPORT_RULES})
    return HttpAnswer(
        kind="application/octet-stream", headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
