"""Access checks of the workbench, made before any route is reached.

A request passes if its ``Host`` names this server, its ``Origin`` (if it has one) is this server, and it has the token,
as a cookie or as ``Authorization: Bearer``. The start address contains the token, which the server exchanges for the
cookie. WebSockets must have an ``Origin``: browsers always send it, but allow every page to open a WebSocket. Bodies of
requests have limits of size and of time while they are read, and a limit of their total memory. The rate of requests is
limited: all requests with the token have one limit, and requests without it have a limit per address, so that no
address uses up the limit of others.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import json
import time
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any
from urllib.parse import parse_qs

from starlette.exceptions import HTTPException

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

LARGEST = 20_000_000
"""Largest size of the body of a request [bytes]."""
LOOPBACK = ("127.0.0.1", "localhost", "::1")
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; "
    "font-src 'self'; connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
    "cache-control": "no-cache",
}
_MOST_HELD = 100_000_000  # bytes of all bodies that are being read
_LONGEST_BODY = 60.0  # seconds: 20 MB at 2.7 Mbit/s
_LONGEST_SIGN_IN = 2.0  # seconds
_MOST_SIGN_INS = 32  # at a time, from all addresses: the others of the server's connections are for the page
_LONGEST_START = 200  # bytes of the query of the start address
_MOST_ADDRESSES = 1000
_PREFIX = 64  # bits of an IPv6 address that one machine has to itself
_TOO_LARGE = f"the body is larger than {LARGEST / 1e6:.0f} MB"
_MOST_SOCKETS = 64
_SIGN_IN = "/api/session"
_START = """<!doctype html><html lang="en"><meta charset="utf-8"><title>gearrattle</title>
<h1>Open the workbench by its start address</h1>
<p>This page needs the address that <code>gearrattle serve</code> printed when it started:
the first line in its terminal.</p>
{form}</html>"""
_FORM = """<form method="post" action="/api/session"><label>Password <input type="password" name="password" required
autocomplete="current-password"></label> <button>Sign in</button></form>"""


class Pace:
    """A rate limit: a number of events at once, and then a number of events per second.

    Examples
    --------
    >>> from gearrattle.workbench.access import Pace
    >>> pace = Pace(2, 1.0, clock=lambda: 0.0)
    >>> [pace.allows() for _ in range(3)]
    [True, True, False]
    """

    def __init__(self, at_once: int, a_second: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._most = float(at_once)
        self._rate = a_second
        self._clock = clock
        self._left = self._most
        self._at = clock()

    def allows(self) -> bool:
        """Return whether one more event is allowed now; an allowed event is counted."""
        now = self._clock()
        self._left = min(self._most, self._left + (now - self._at) * self._rate)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Strangers:
    """The rate limits of addresses that send requests without the token; the oldest of very many are forgotten.

    Examples
    --------
    >>> from gearrattle.workbench.access import Strangers
    >>> strangers = Strangers(1, 0.0)
    >>> [strangers.allows(address) for address in ("10.0.0.7", "10.0.0.7", "10.0.0.8")]
    [True, False, True]
    """

    def __init__(self, at_once: int, a_second: float) -> None:
        self._at_once = at_once
        self._a_second = a_second
        self._paces: dict[str, Pace] = {}

    def allows(self, address: str) -> bool:
        """Whether one more request of an address may be answered now; if so it counts."""
        machine = _machine(address)
        pace = self._paces.pop(machine, None) or Pace(self._at_once, self._a_second)
        self._paces[machine] = pace
        if len(self._paces) > _MOST_ADDRESSES:
            del self._paces[next(iter(self._paces))]
        return pace.allows()


class Access:
    """The application with checks of host, token and password in front of it (empty password: none)."""

    def __init__(self, application: Application, host: str, token: str, password: str = "") -> None:
        self._application = application
        self._host = host
        self._token = token
        self._password = password
        self._strangers = Strangers(20, 5.0)
        self._requests = Pace(2000, 400.0)
        self._sockets = 0
        self._sign_ins = 0
        self._held = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, or pass on."""
        if scope["type"] == "http":
            await self._http(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await self._socket(scope, receive, send)
        else:
            await self._application(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = _headers(scope)
        if (refusal := self._why_foreign(scope, headers)) is not None:
            await _answer(send, 403, refusal)
        elif self._has_token(scope, headers):
            await self._with_token(scope, headers, receive, send)
        elif not self._strangers.allows((scope.get("client") or ("", 0))[0]) or self._sign_ins >= _MOST_SIGN_INS:
            await _answer(send, 429, "too many requests without the token; try again in a minute")
        elif scope["path"] == "/" and scope["method"] == "GET":
            await self._start(send)
        elif scope["path"] == _SIGN_IN and scope["method"] == "POST" and self._password:
            await self._sign_in(scope, receive, send)
        else:
            await _answer(send, 401, "open the workbench by the start address that gearrattle serve printed")

    async def _with_token(self, scope: Scope, headers: dict[str, str], receive: Receive, send: Send) -> None:
        """Answer a request with the token, or pass it on."""
        if not self._requests.allows():
            await _answer(send, 429, "too many requests at once; try again in a second")
        elif _length(headers) > LARGEST:
            await _answer(send, 413, _TOO_LARGE)
        elif scope["path"] == "/" and b"token=" in scope.get("query_string", b""):
            await _redirect(send, self._cookie(scope))
        else:
            await self._pass_on(scope, receive, send)

    async def _socket(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = _headers(scope)
        refused = (
            "origin" not in headers
            or self._why_foreign(scope, headers) is not None
            or not self._has_token(scope, headers)
            or self._sockets >= _MOST_SOCKETS
        )
        if refused:
            await receive()
            await send({"type": "websocket.close", "code": 1008})
            return
        self._sockets += 1
        try:
            await self._application(scope, receive, send)
        finally:
            self._sockets -= 1

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Call the application with a body that ends at the limits of size and time."""
        size = 0
        is_whole = False
        end = time.monotonic() + _LONGEST_BODY

        # one message of the body, within the limits of time, size and memory
        async def limited() -> Message:
            nonlocal size, is_whole
            if is_whole:  # what comes now is the end of the connection
                return await receive()
            try:
                message = await asyncio.wait_for(receive(), end - time.monotonic())
            except TimeoutError:
                raise _refused(408, f"the body took more than {_LONGEST_BODY:.0f} s") from None
            length = len(message.get("body", b""))
            size += length
            self._held += length
            is_whole = not message.get("more_body", False)
            if size > LARGEST:
                raise _refused(413, _TOO_LARGE)
            if self._held > _MOST_HELD:
                raise _refused(503, "too much is uploaded at once; try again in a moment")
            return message

        # free the memory that the body held
        try:
            await self._application(scope, limited, send)
        finally:
            self._held -= size

    def _why_foreign(self, scope: Scope, headers: dict[str, str]) -> str | None:
        """Why a request comes from elsewhere; None if it does not."""
        host = headers.get("host", "")
        if not self._is_here(scope, host):
            return "the Host of the request is not this server"
        origin = headers.get("origin")
        if origin is not None and origin != f"http://{host}":
            return "the Origin of the request is not this server"
        site = headers.get("sec-fetch-site")
        is_start = scope.get("method") == "GET" and scope["path"] == "/"
        if site not in (None, "none", "same-origin") and not is_start:
            return "the request comes from another site"
        return None

    def _is_here(self, scope: Scope, host: str) -> bool:
        """Whether a Host names this server; a name that anybody may point here (DNS rebinding) does not."""
        name, port = _split(host)
        server = scope.get("server")
        if server is None or port != server[1]:
            return False
        if self._host in LOOPBACK:
            return name in LOOPBACK
        return name in (self._host, "localhost") or _is_address(name)

    def _has_token(self, scope: Scope, headers: dict[str, str]) -> bool:
        """Whether a request carries the token."""
        words = [headers.get("authorization", "").removeprefix("Bearer "), *_cookies(headers, _cookie_name(scope))]
        if scope["path"] == "/":
            query = scope.get("query_string", b"")[:_LONGEST_START].decode("latin-1")
            words += parse_qs(query).get("token", [])[:1]
        return any(hmac.compare_digest(word.encode(), self._token.encode()) for word in words)

    async def _start(self, send: Send) -> None:
        page = _START.format(form=_FORM if self._password else "")
        await _answer(send, 401, page, kind="text/html; charset=utf-8")

    async def _sign_in(self, scope: Scope, receive: Receive, send: Send) -> None:
        body = b""
        self._sign_ins += 1
        try:
            async with asyncio.timeout(_LONGEST_SIGN_IN):
                while len(body) < 4096:
                    message = await receive()
                    body += message.get("body", b"")
                    if not message.get("more_body"):
                        break
        except TimeoutError:
            await _answer(send, 408, "the password did not come")
            return
        finally:
            self._sign_ins -= 1
        password = parse_qs(body.decode("latin-1"), encoding="utf-8").get("password", [""])[0]
        if hmac.compare_digest(password.encode(), self._password.encode()):
            await _redirect(send, self._cookie(scope))
        else:
            await _answer(send, 401, "this is not the password")

    def _cookie(self, scope: Scope) -> str:
        return f"{_cookie_name(scope)}={self._token}; Path=/; HttpOnly; SameSite=Strict"


def _headers(scope: Scope) -> dict[str, str]:
    """Headers by name; a repeated header has all its values, so that checks and application see the same."""
    headers: dict[str, str] = {}
    for raw_name, raw_value in scope["headers"]:
        name = raw_name.decode("latin-1").lower()
        value = raw_value.decode("latin-1")
        headers[name] = f"{headers[name]}, {value}" if name in headers else value
    return headers


def _length(headers: dict[str, str]) -> int:
    """Return the length of the body that a request states [bytes]; 0 where it states none."""
    text = headers.get("content-length", "")
    return int(text) if text.isascii() and text.isdigit() else 0


def _split(host: str) -> tuple[str, int]:
    """Name and port of a Host; -1 where there is no number."""
    name, colon, port = host.rpartition(":")
    if not colon or (host.startswith("[") and host.endswith("]")):
        name = host
        port = "80"
    return name.strip("[]").lower(), int(port) if port.isascii() and port.isdigit() else -1


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _machine(address: str) -> str:
    """Return what stands for all addresses of a machine: one of version 4, or the network of one of version 6."""
    try:
        number = ipaddress.ip_address(address)
    except ValueError:
        return address
    if number.version == 4:
        return address
    if number.ipv4_mapped is not None:  # how a socket for both versions names an address of version 4
        return str(number.ipv4_mapped)
    return str(ipaddress.ip_network((number.packed, _PREFIX), strict=False))


def _refused(status: int, rule: str) -> HTTPException:
    """Return the error of a request whose body is not read on."""
    return HTTPException(status, rule, {"connection": "close"})


def _cookie_name(scope: Scope) -> str:
    """The cookie's name: cookies are shared between the ports of a machine."""
    return f"gearrattle-{(scope.get('server') or ('', 0))[1]}"


def _cookies(headers: dict[str, str], name: str) -> list[str]:
    """Return the values of all cookies of a name: a server at another port of this machine may have set one too.

    ``http.cookies`` takes minutes for a long row of backslashes, and a token needs none of its quoting.
    """
    pairs = (pair.partition("=") for pair in headers.get("cookie", "").split(";"))
    return [value.strip() for key, _, value in pairs if key.strip() == name]


def _with_headers(send: Send) -> Send:
    """Return a ``send`` that adds the headers of every answer, unless it has them."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            present = {name.lower() for name, _ in message.get("headers", [])}
            more = _encoded((name, value) for name, value in _HEADERS.items() if name.encode() not in present)
            message["headers"] = [*message.get("headers", []), *more]
        await send(message)

    return sending


def _encoded(headers: Iterable[tuple[str, str]]) -> list[tuple[bytes, bytes]]:
    return [(name.encode(), value.encode()) for name, value in headers]


async def _answer(send: Send, status: int, words: str, kind: str = "") -> None:
    """Send a problem, or a page."""
    body = words if kind else json.dumps({"problems": [{"place": "request", "value": "", "rule": words, "remedy": ""}]})
    headers = {"content-type": kind or "application/json", "connection": "close"}
    await send({"type": "http.response.start", "status": status, "headers": _encoded(headers.items())})
    await send({"type": "http.response.body", "body": body.encode()})


async def _redirect(send: Send, cookie: str) -> None:
    headers = {"location": "/", "set-cookie": cookie, "cache-control": "no-store"}
    await send({"type": "http.response.start", "status": 303, "headers": _encoded(headers.items())})
    await send({"type": "http.response.body", "body": b""})
