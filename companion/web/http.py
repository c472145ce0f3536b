"""HTTP/1.1 as far as the page needs it: one request read by the standard library's parser, one answer, hard bounds. No I/O.

A connection carries one request, or orders one after another. What is not GET or POST, too long, folded, or has a body of unknown length
is refused.
"""

from __future__ import annotations

import ipaddress
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from io import BytesIO
from typing import Any, Final

HEAD_MAX: Final = 8192
"""Bytes of a request's head: four times what a browser sends."""
BODY_MAX: Final = 1024
"""Bytes of a request's body; an order has some 200."""
_LOCAL_ENDS: Final = (".local", ".lan", ".home.arpa", ".internal")
"""Names that only a local network gives out."""
SAFE: Final = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-store",
}
"""What every answer says, unless it says otherwise itself."""


class BadRequestError(ValueError):
    """A request that is not answered, with the status that says why."""

    def __init__(self, status: HTTPStatus, why: str = "") -> None:
        super().__init__(why or status.phrase)
        self.status = status


@dataclass(frozen=True, slots=True)
class HttpRequest:
    """One request."""

    method: str
    path: str
    """Without the query."""
    headers: Mapping[str, str]
    """By lower-case name; of several of one name the request is refused where that matters."""
    body_bytes: int = 0
    """Length of the body that follows."""
    peer: str = ""
    """Address of who asks."""


@dataclass(frozen=True, slots=True)
class HttpAnswer:
    """One answer: whole, or a ``head`` before something that flows."""

    status: HTTPStatus = HTTPStatus.OK
    kind: str = "text/plain; charset=utf-8"
    body: bytes = b""
    headers: Mapping[str, str] = field(default_factory=dict)

    def head(self, length: int | None, *, kept: bool = False) -> bytes:
        """Status line and headers; ``length`` None: until the connection ends. ``kept``: it may carry another request."""
        lines = {**SAFE, **self.headers, "Content-Type": self.kind, "Connection": "keep-alive" if kept else "close"}
        if length is not None:
            lines["Content-Length"] = str(length)
        text = "".join(f"{name}: {value}\r\n" for name, value in lines.items())
        return f"HTTP/1.1 {self.status.value} {self.status.phrase}\r\n{text}\r\n".encode("latin-1", "replace")

    def whole(self, *, kept: bool = False) -> bytes:
        """All of it."""
        return self.head(len(self.body), kept=kept) + self.body


def as_json(data: Any, status: HTTPStatus = HTTPStatus.OK) -> HttpAnswer:
    """An answer of JSON."""
    body = json.dumps(data, separators=(",", ":"), ensure_ascii=False).encode()
    return HttpAnswer(status, "application/json", body)


class _Head(BaseHTTPRequestHandler):
    """The standard library's reading of a head that is there already."""

    def __init__(self, head: bytes) -> None:
        self.rfile = BytesIO(head)
        self.raw_requestline = self.rfile.readline()
        self.wrong: int | None = None
        self.request_version = "HTTP/0.9"
        if not self.parse_request():
            self.wrong = self.wrong or HTTPStatus.BAD_REQUEST

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        self.wrong = code

    def send_response_only(self, code: int, message: str | None = None) -> None:
        """The library would answer "100 Continue" here."""

    def end_headers(self) -> None:
        """Nothing is sent from here."""


def read_head(head: bytes) -> HttpRequest:
    """Read a request's head, up to the empty line. Raises BadRequestError."""
    if len(head) > HEAD_MAX:
        raise BadRequestError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE)
    try:
        found = _Head(head)
    except Exception as error:  # whatever a stranger's bytes bring about in a parser is his own fault
        raise BadRequestError(HTTPStatus.BAD_REQUEST) from error
    if found.wrong is not None:
        raise BadRequestError(HTTPStatus(found.wrong))
    if found.command not in ("GET", "POST"):
        raise BadRequestError(HTTPStatus.METHOD_NOT_ALLOWED)
    if not found.path.startswith("/") or found.request_version not in ("HTTP/1.0", "HTTP/1.1"):
        raise BadRequestError(HTTPStatus.BAD_REQUEST)
    headers = {name.lower(): value.strip() for name, value in found.headers.items()}
    for name in ("host", "content-length", "origin", "content-type"):
        if len(found.headers.get_all(name, [])) > 1:
            raise BadRequestError(HTTPStatus.BAD_REQUEST)
    if "transfer-encoding" in headers:
        raise BadRequestError(HTTPStatus.LENGTH_REQUIRED)
    return HttpRequest(found.command, found.path.partition("?")[0], headers, _length(headers))


def _length(headers: Mapping[str, str]) -> int:
    text = headers.get("content-length", "0")
    if not (text.isascii() and text.isdecimal()):
        raise BadRequestError(HTTPStatus.BAD_REQUEST)
    if len(text) > 9 or int(text) > BODY_MAX:
        raise BadRequestError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
    return int(text)


def check_host(request: HttpRequest, names: tuple[str, ...]) -> None:
    """Refuse a name that somebody else's name server could have led here (DNS rebinding). Raises BadRequestError."""
    host = request.headers.get("host", "").lower()
    name = host.rpartition(":")[0] if not host.endswith("]") and ":" in host else host
    name = name.removeprefix("[").removesuffix("]").rstrip(".")
    try:
        ipaddress.ip_address(name)
        return
    except ValueError:
        pass
    if name and ("." not in name or name.endswith(_LOCAL_ENDS) or name in names):
        return
    raise BadRequestError(
        HTTPStatus.MISDIRECTED_REQUEST, f"this name is not the boat's; page.names lists more: {name[:80]!r}"
    )


def check_own_page(request: HttpRequest) -> None:
    """Refuse an order that another site's page sends through an operator's browser. Raises BadRequestError."""
    origin = request.headers.get("origin", "")
    same = origin.partition("://")[2].lower() == request.headers.get("host", "").lower() != ""
    site = request.headers.get("sec-fetch-site", "same-origin")
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if not same or site != "same-origin" or kind != "application/json":
        raise BadRequestError(HTTPStatus.FORBIDDEN, "orders come from the boat's own page only")
