"""A real browser for pages: Chromium without a screen, and what it has to say.

Takes pages; gives what the browser printed.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
MARKS = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine"),
]
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND",
    "--virtual-time-budget=30000",
    "--window-size=1280,9000",
    "--enable-logging=stderr",
    "--v=0",
)


def browse(page: Path, profile: Path, *flags: str) -> subprocess.CompletedProcess[str]:
    command = [str(BROWSER), *FLAGS, f"--user-data-dir={profile}", *flags, page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)


def alive(page: Path, folder: Path, sign: str, count: int = 1) -> subprocess.CompletedProcess[str]:
    """Look until a sign of life has come as often as it must: a busy machine may not have let it be drawn in time."""
    for attempt in range(4):
        done = browse(page, folder / f"profile-{attempt}", "--dump-dom")
        assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
        if done.stdout.count(sign) >= count:
            break
    return done
