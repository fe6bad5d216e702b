"""The question for known vulnerabilities of pinned packages: a service that gives no answer is never "none"."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from tests.architecture.places import ROOT

SCRIPT = ROOT / ".ci" / "vulnerabilities"
PINS = "# versions\nnumpy==2.0.0\nscipy==1.14.0 ; python_version < '4'\n"
KNOWN = {"results": [{"vulns": [{"id": "PYSEC-1"}, {"id": "GHSA-2"}]}, {}]}
NONE = {"results": [{}, {}]}


@contextmanager
def service(status: int, body: str) -> Iterator[tuple[str, list[dict[str, object]]]]:
    """Yield the address of a service with one answer, and what it was asked."""
    asked = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            asked.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(status)
            self.end_headers()
            self.wfile.write(body.encode())

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = HTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/query", asked
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def asked_of(address: str, folder: Path, pins: str = PINS) -> subprocess.CompletedProcess[str]:
    (folder / "pins.txt").write_text(pins, encoding="utf-8")
    environment = {**os.environ, "OSV_URL": address, "no_proxy": "*"}
    command = [sys.executable, str(SCRIPT), "pins.txt"]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60, check=False)


def test_every_pin_is_asked_about_and_what_is_known_is_named(tmp_path: Path) -> None:
    with service(200, json.dumps(KNOWN)) as (address, asked):
        done = asked_of(address, tmp_path)
    assert done.returncode == 1
    assert "numpy 2.0.0: PYSEC-1, GHSA-2\n" in done.stdout
    assert "1 of 2 packages" in done.stdout
    names = [("numpy", "2.0.0"), ("scipy", "1.14.0")]
    queries = [{"package": {"name": name, "ecosystem": "PyPI"}, "version": version} for name, version in names]
    assert asked == [{"queries": queries}]


def test_none_is_said_where_the_service_says_so(tmp_path: Path) -> None:
    with service(200, json.dumps(NONE)) as (address, _):
        done = asked_of(address, tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "0 of 2 packages" in done.stdout


@pytest.mark.parametrize(
    ("status", "body"),
    [
        (404, "not found"),
        (503, json.dumps(NONE)),
        (200, "<html>a login page</html>"),
        (200, "[]"),
        (200, "{}"),
        (200, json.dumps({"results": [{}]})),
        (200, json.dumps({"results": [None, None]})),
        (200, json.dumps({"results": [{"vulns": [{}]}, {}]})),
    ],
)
def test_another_answer_is_no_answer(tmp_path: Path, status: int, body: str) -> None:
    with service(status, body) as (address, _):
        done = asked_of(address, tmp_path)
    assert (done.returncode, done.stdout) == (3, "")
    assert "NOT CHECKED" in done.stderr


@pytest.mark.parametrize("address", ["http://127.0.0.1:9/query", "http://nowhere.invalid/query", "no address"])
def test_a_service_that_cannot_be_reached_is_named(tmp_path: Path, address: str) -> None:
    done = asked_of(address, tmp_path)
    assert (done.returncode, done.stdout) == (3, "")
    assert f"NOT CHECKED: {address} gave no answer" in done.stderr
    assert "Whether the 2 packages of pins.txt have known ones is not known" in done.stderr


@pytest.mark.parametrize("pins", ["", "numpy>=2\n"])
def test_a_list_that_pins_nothing_is_refused(tmp_path: Path, pins: str) -> None:
    assert asked_of("http://127.0.0.1:9", tmp_path, pins).returncode == 2


def test_the_list_of_the_project_is_read(tmp_path: Path) -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    done = asked_of("http://127.0.0.1:9", tmp_path, text)
    count = sum("==" in row for row in text.splitlines())
    assert f"the {count} packages" in done.stderr
