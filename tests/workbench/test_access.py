"""Who gets in: no foreign origin, no request without the token, no path outside, no body without end."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from urllib.parse import quote

import httpx
import pytest

from gearrattle.errors import ModelError
from gearrattle.workbench import access
from gearrattle.workbench.access import Access, Message, Receive, Scope, Send, Strangers
from gearrattle.workbench.jobs.worker import resident_bytes
from gearrattle.workbench.workspace_folder import Folder

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

import uvicorn
from starlette.exceptions import HTTPException
from uvicorn.server import ServerState
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from gearrattle.workbench.application import all_routes
from tests.workbench.server import MODEL, Server, serving

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    outer = tmp_path_factory.mktemp("outer")
    (outer / "secret.toml").write_text("secret", encoding="utf-8")
    (outer / "beside.csv").write_text("t [s],T [N*m]\n0,1\n2,2\n4,1\n6,0\n", encoding="utf-8")
    inner = outer / "inner"
    inner.mkdir()
    (inner / "link.toml").symlink_to(outer / "secret.toml")
    (inner / "up").symlink_to(outer)
    (inner / "model.toml").write_text(MODEL, encoding="utf-8")
    return inner


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[Server]:
    """Started in the folder above, whose files a model on the command line may name."""
    with serving(folder, within=folder.parent) as server:
        yield server


def foreign(port: int) -> list[str]:
    return [
        "http://example.com",
        "https://example.com",
        f"http://example.com:{port}",
        f"https://127.0.0.1:{port}",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        f"http://127.0.0.1:{port}.example.com",
        f"http://127.0.0.1.example.com:{port}",
        f"http://127.0.0.1:{port}@example.com",
        f"http://example.com/127.0.0.1:{port}",
        f"http://127.0.0.2:{port}",
        f"http://[::1]:{port}",
        f"http://localhost:{port}",
        f"http://0.0.0.0:{port}",
        f"http://127.0.0.1:{port}/",
        f"ftp://127.0.0.1:{port}",
        "null",
        "file://",
        "",
        "chrome-extension://abcdefgh",
    ]


def test_no_foreign_origin_is_accepted(server: Server) -> None:
    origins = foreign(server.port)
    assert len(origins) == 20
    cookies = "; ".join(f"{name}={value}" for name, value in server.client.cookies.items())
    for origin in origins:
        for method, path in (("GET", "/api/jobs"), ("POST", "/api/jobs"), ("GET", "/")):
            assert server.client.request(method, path, headers={"origin": origin}).status_code == 403, origin
        with pytest.raises(InvalidStatus):
            connect(f"ws://127.0.0.1:{server.port}/api/events", origin=origin, additional_headers={"Cookie": cookies})  # type: ignore[arg-type]
    own = f"http://127.0.0.1:{server.port}"
    assert server.client.get("/api/jobs", headers={"origin": own}).status_code == 200
    with connect(f"ws://127.0.0.1:{server.port}/api/events", origin=own, additional_headers={"Cookie": cookies}):  # type: ignore[arg-type]
        pass


def test_a_name_that_anybody_may_point_here_is_no_host_of_it(server: Server) -> None:
    for host in ("example.com", f"example.com:{server.port}", "127.0.0.1", f"127.0.0.1:{server.port + 1}", ""):
        assert server.client.get("/api/jobs", headers={"host": host}).status_code in (400, 403), host
    assert server.client.get("/api/jobs", headers={"host": f"localhost:{server.port}"}).status_code == 200


def test_another_site_may_not_ask_even_where_it_hides_its_origin(server: Server) -> None:
    for site in ("cross-site", "same-site"):
        assert server.client.get("/api/jobs", headers={"sec-fetch-site": site}).status_code == 403


def test_nothing_answers_without_the_token(server: Server) -> None:
    paths = {route.path.replace("{path:path}", "model.toml") for route in all_routes() if hasattr(route, "methods")}  # type: ignore[attr-defined]
    assert len(paths) > 20
    with httpx.Client(base_url=server.address) as stranger:
        for path in [*paths, "/", "/static/app.js", "/static/page.html", "/nothing"]:
            for headers in ({}, {"cookie": f"gearrattle-{server.port}=x"}, {"authorization": "Bearer x"}):
                for method in ("GET", "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "HEAD"):
                    status = stranger.request(method, path, headers=headers).status_code
                    assert status in (401, 429), (method, path, status)
        assert not stranger.cookies
    with pytest.raises(InvalidStatus):
        connect(f"ws://127.0.0.1:{server.port}/api/events", origin=server.address)  # type: ignore[arg-type]


def test_the_token_is_exchanged_for_a_cookie_that_scripts_do_not_see(server: Server) -> None:
    answer = server.client.get(f"/?token={server.token}")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/"
    assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in answer.headers["set-cookie"].split(";")}
    page = server.client.get("/")
    assert page.status_code == 200
    policy = page.headers["content-security-policy"]
    assert "unsafe" not in policy
    assert "access-control-allow-origin" not in page.headers
    assert page.headers["x-content-type-options"] == "nosniff"


PATHS = [
    *("../" * n + "secret.toml" for n in range(1, 21)),
    *("inner/../" * n + "../secret.toml" for n in range(1, 11)),
    *(f"..{sign}secret.toml" for sign in ("\\", "//", "/./", "%2f", "%5c", "\0/", "/\0")),
    *(
        f"{name}/secret.toml"
        for name in ("..", "...", "....", ". .", " ..", ".. ", "..;", "~", "$HOME", "up", "up/inner/..")
    ),
    *(f"/{'x/../' * n}etc/passwd" for n in range(10)),
    *("link.toml", "up/secret.toml", "up/inner/link.toml", "./link.toml", ".gearrattle/jobs", ".gearrattle/.lock"),
    *(f"C:{sign}secret.toml" for sign in ("\\", "/", "")),
    *("file:///etc/passwd", "//etc/passwd", "///etc/passwd", "\\\\server\\share", "con:", "a" * 5000, "a/" * 200, "."),
    *(f"{'%2e%2e/' * n}secret.toml" for n in range(1, 11)),
    *(f"{'%252e%252e/' * n}secret.toml" for n in range(1, 6)),
    *(
        "..%c0%afsecret.toml",
        "..%ef%bc%8fsecret.toml",
        "%00../secret.toml",
        "..\u2215secret.toml",
        "\uff0e\uff0e/secret.toml",
    ),
    *("secret.toml\r\nx: y", "\n../secret.toml", "..\t/secret.toml", "\x7f/../secret.toml", "..\u202e/secret.toml"),
]


def test_no_path_leads_outside(server: Server, folder: Path) -> None:
    assert len(PATHS) >= 100
    paths = Folder(folder)
    for name in PATHS:
        with suppress(ModelError):
            assert paths.path(name).is_relative_to(folder), name
        for text in (name, quote(name, safe=""), quote(name, safe="/%")):
            for path in (
                f"/api/files/{text}",
                f"/static/{text}",
                f"/api/jobs/{text}/model.toml",
                f"/widgets/{text}.js",
            ):
                try:
                    answer = server.client.get(path)
                except (httpx.InvalidURL, httpx.LocalProtocolError):
                    continue
                assert answer.text != "secret", path
                assert "root:" not in answer.text, path
        written = server.client.put(f"/api/files/{quote(name, safe='')}", content="changed")
        assert written.status_code in (200, 400, 404, 405), name
    assert (folder.parent / "secret.toml").read_text(encoding="utf-8") == "secret"
    assert {path.name for path in folder.parent.iterdir()} == {"secret.toml", "beside.csv", "inner"}


def test_a_model_names_no_file_beside_the_folder(server: Server, folder: Path) -> None:
    text = MODEL.replace(
        "harmonics = [{ order = 1, amplitude = 2.0 }]", 'signal = { file = "FILE", time = "t", value = "T" }'
    )
    outside = text.replace("FILE", "../beside.csv")
    checked = server.client.post("/api/check", json={"text": outside}).json()["problems"]
    answers = [
        server.client.post("/api/live", json={"text": outside, "values": {}}),
        server.client.post("/api/jobs", json={"text": outside, "task": "run"}),
    ]
    assert [answer.status_code for answer in answers] == [400, 400]
    for problem in (*checked, *(answer.json()["problems"][0] for answer in answers)):
        assert "lies outside of" in problem["rule"]
    (folder / "own.csv").write_bytes((folder.parent / "beside.csv").read_bytes())
    inside = {"text": text.replace("FILE", "own.csv"), "values": {}}
    assert server.client.post("/api/live", json=inside).status_code == 200


def settled_bytes(pid: int) -> int:
    """The resident size of a process that has not grown for two seconds."""
    readings = [resident_bytes(pid)]
    for _ in range(60):
        time.sleep(0.5)
        readings.append(resident_bytes(pid))
        if len(readings) > 4 and readings[-1] - readings[-5] < 1_000_000:
            return readings[-1]
    raise AssertionError(f"the server still grows: {readings}")


@pytest.mark.slow
def test_a_gigabyte_is_refused_while_it_is_read(server: Server) -> None:
    assert server.client.put("/api/files/small.csv", content=b"time,speed\n0,1\n").is_success
    before = settled_bytes(server.process.pid)  # what a server loads after its first answer is not the upload's
    for head in (b"Content-Length: 1000000000\r\n", b"Transfer-Encoding: chunked\r\n"):
        cookie = f"gearrattle-{server.port}={server.token}".encode()
        with socket.create_connection(("127.0.0.1", server.port)) as wire:
            wire.settimeout(30.0)
            host = f"127.0.0.1:{server.port}".encode()
            wire.sendall(
                b"PUT /api/files/big.csv HTTP/1.1\r\nHost: "
                + host
                + b"\r\nCookie: "
                + cookie
                + b"\r\n"
                + head
                + b"\r\n"
            )
            answers: list[bytes] = []
            reader = threading.Thread(target=_answer_into, args=(wire, answers))
            reader.start()
            sent, part = 0, b"0" * 1_000_000
            try:
                while sent < 1_000_000_000 and not answers:
                    wire.sendall(b"f4240\r\n" + part + b"\r\n" if b"chunked" in head else part)
                    sent += len(part)
            except OSError:
                pass
            reader.join(30.0)
            assert answers[0].startswith(b"HTTP/1.1 413")
            assert sent < 100_000_000
    assert resident_bytes(server.process.pid) - before < 100_000_000
    assert not [entry for entry in server.client.get("/api/files").json() if entry["path"] == "big.csv"]


def _answer_into(wire: socket.socket, answers: list[bytes]) -> None:
    answers.append(wire.recv(4096))


@pytest.mark.slow
def test_hundreds_of_connections_leave_nothing(server: Server) -> None:
    def opened() -> int:
        return len(list(Path(f"/proc/{server.process.pid}/fd").iterdir()))

    def visit(count: int) -> None:
        for _ in range(count):
            with socket.create_connection(("127.0.0.1", server.port)) as wire:
                wire.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")

    def answers() -> bool:
        end = time.monotonic() + 10.0
        while server.client.get("/api/jobs").status_code != 200 and time.monotonic() < end:
            time.sleep(0.05)
        return server.client.get("/api/jobs").status_code == 200

    visit(100)
    assert answers()
    descriptors, memory = opened(), resident_bytes(server.process.pid)
    visit(400)
    assert answers()
    assert opened() <= descriptors + 20
    assert resident_bytes(server.process.pid) - memory < 8_000_000


def _page_answers(server: Server) -> bool:
    """Whether the page and the list of runs are there."""
    return [server.client.get(path).status_code for path in ("/", "/api/jobs")] == [200, 200]


def test_silent_connections_do_not_keep_the_page_out(server: Server) -> None:
    """More heads are begun than the server serves requests at a time."""
    assert _page_answers(server)
    before = len(list(Path(f"/proc/{server.process.pid}/fd").iterdir()))
    wires = []
    for _ in range(400):
        wire = socket.create_connection(("127.0.0.1", server.port), timeout=10.0)
        with suppress(OSError):
            wire.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX: ")
        wires.append(wire)
    assert _page_answers(server)
    assert len(list(Path(f"/proc/{server.process.pid}/fd").iterdir())) < before + 80
    for wire in wires:
        wire.close()


def test_a_connection_has_so_long_for_its_head(monkeypatch: pytest.MonkeyPatch) -> None:
    from gearrattle.workbench import connections

    closed: list[str] = []

    class Transport(asyncio.Transport):
        def abort(self) -> None:
            closed.append("aborted")

        def get_extra_info(self, _name: str, default: object = None) -> object:
            return default

    async def wait() -> None:
        config = uvicorn.Config(lambda *_: None, ws="none")  # type: ignore[arg-type,return-value]
        for data in (b"G", b"GET / HTTP/1.1\r\n"):
            connection = connections.Connection(config, ServerState(), {})
            connection.connection_made(Transport())
            connection.data_received(data)
        await asyncio.sleep(0.2)

    monkeypatch.setattr(connections, "_LONGEST", 0.05)
    asyncio.run(wait())
    assert closed == ["aborted", "aborted"]


def test_requests_without_the_token_spend_nothing_of_those_with_it(server: Server) -> None:
    with httpx.Client(base_url=server.address) as stranger:
        statuses = [stranger.get("/api/jobs").status_code for _ in range(100)]
    assert set(statuses) == {401, 429}
    assert _page_answers(server)


def test_no_cookie_keeps_the_server_busy() -> None:
    long = {b"cookie": b'x="' + b"\\" * 60_000 + b'"'}
    app = Access(_all_of_the_body, "127.0.0.1", "token")
    begin = time.monotonic()
    assert asked(app, _no_body, headers=long) == 401
    assert time.monotonic() - begin < 1.0


def test_a_cookie_of_another_server_of_the_machine_hides_none_of_this_one() -> None:
    app = Access(_all_of_the_body, "127.0.0.1", "token")
    for cookies in (
        "gearrattle-80=token",
        "gearrattle-80=other; a; b=c;gearrattle-80=token",
        'x="; gearrattle-80=token',
    ):
        assert asked(app, _no_body, headers={b"cookie": cookies.encode()}) == 200
    for cookies in ("gearrattle-81=token", "gearrattle-80=", "gearrattle-80", "", "=token"):
        assert asked(app, _no_body, headers={b"cookie": cookies.encode()}) == 401


def test_each_address_has_a_pace_of_its_own() -> None:
    mapped = Strangers(1, 0.0)
    assert [mapped.allows(address) for address in ("::ffff:10.0.0.7", "::ffff:10.0.0.8", "10.0.0.8")] == [
        True,
        True,
        False,
    ]
    strangers = Strangers(2, 0.0)
    for address in ("10.0.0.7", "2001:db8::1", ""):
        assert [strangers.allows(address) for _ in range(3)] == [True, True, False]
    assert not strangers.allows("2001:db8::2")  # one machine has a whole network of them
    assert strangers.allows("2001:db8:1::2")
    for number in range(2000):
        strangers.allows(f"10.1.{number // 250}.{number % 250}")
    assert len(strangers._paces) == 1000


async def _no_body() -> Message:
    return {"type": "http.request", "body": b"", "more_body": False}


def asked(
    access: Access,
    messages: Callable[[], Awaitable[Message]],
    path: str = "/api/jobs",
    headers: Mapping[bytes, bytes] = {b"authorization": b"Bearer token"},
) -> int:
    """The status that a request gets; without headers of its own it has the token."""
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    every = [(b"host", b"127.0.0.1:80"), *headers.items()]
    scope = {"type": "http", "method": "POST", "path": path, "headers": every, "server": ("127.0.0.1", 80)}
    try:
        asyncio.run(access(scope, messages, send))  # type: ignore[arg-type]
    except HTTPException as error:
        return error.status_code
    return int(sent[0]["status"])


async def _all_of_the_body(_scope: Scope, receive: Receive, send: Send) -> None:
    while (await receive()).get("more_body"):
        pass
    await send({"type": "http.response.start", "status": 200})


def test_a_body_has_so_long_and_all_bodies_so_much(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never() -> Message:
        await asyncio.sleep(60.0)
        raise AssertionError

    async def whole() -> Message:
        return {"type": "http.request", "body": b"0" * 1000, "more_body": False}

    app = Access(_all_of_the_body, "127.0.0.1", "token")
    assert asked(app, whole) == 200
    assert app._held == 0
    monkeypatch.setattr(access, "_LONGEST_BODY", 0.2)
    assert asked(app, never) == 408
    monkeypatch.setattr(access, "_MOST_HELD", 999)
    assert asked(app, whole) == 503
    assert app._held == 0


def test_a_password_has_so_long(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never() -> Message:
        await asyncio.sleep(60.0)
        raise AssertionError

    monkeypatch.setattr(access, "_LONGEST_SIGN_IN", 0.05)
    app = Access(_all_of_the_body, "127.0.0.1", "another token", "a long password")
    assert asked(app, never, "/api/session") == 408


def test_few_sign_ins_wait_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never() -> Message:
        await asyncio.sleep(60.0)
        raise AssertionError

    async def sign_in(number: int) -> int:
        sent: list[Message] = []

        async def send(message: Message) -> None:
            sent.append(message)

        scope = {"type": "http", "method": "POST", "path": "/api/session", "headers": [(b"host", b"127.0.0.1:80")]}
        await app({**scope, "server": ("127.0.0.1", 80), "client": (f"10.0.0.{number}", 0)}, never, send)
        return int(sent[0]["status"])

    async def flood() -> list[int]:
        return await asyncio.gather(*(sign_in(number) for number in range(100)))

    monkeypatch.setattr(access, "_LONGEST_SIGN_IN", 0.05)
    app = Access(_all_of_the_body, "127.0.0.1", "token", "a long password")
    assert sorted(asyncio.run(flood())) == [408] * 32 + [429] * 68
    assert app._sign_ins == 0
