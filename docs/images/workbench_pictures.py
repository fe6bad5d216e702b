"""Take the pictures of the workbench that its page of the manual shows: editor, verdict, study map, branches, measured.

A server is started on a folder with a few finished jobs, and Chromium looks at its pages. This is an extension of the
manual's build, which takes the pictures where they are older than the workbench; ``make images`` takes them too. They
are not committed. Without Chromium there are none, and the directive ``workbench-picture`` puts nothing in their place.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst.directives.images import Figure

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parents[1] / "src" / "gearrattle" / "workbench"
MODEL = "case3"
BACKLASH, AMPLITUDE = "mesh.gear.backlash", "torque.0.harmonics.0.amplitude"
PICTURES = {
    "editor": ("#/edit?job=wide", ".ed-verdict:not(.stale)"),
    "verdict": ("#/runs/wide", ".gr-headline"),
    "map": ("#/runs/map", ".gr-tabpanel canvas"),
    "branches": ("#/runs/branches", ".gr-motion-words"),
    "measured": ("#/measured?job=wide&file=rig.csv", "section[aria-label=Spectra] canvas"),
}
"""Name -> the address of a page, and what it shows when it is there."""
FOLDER = "images"
SIZE = {"width": 1280, "height": 800}


def path_of(name: str, folder: Path = HERE) -> Path:
    """Return where a picture is."""
    return folder / f"workbench-{name}.png"


def browser() -> str | None:
    """Return the path of Chromium; None where it, or what drives it, is not installed."""
    if any(find_spec(name) is None for name in ("playwright", "uvicorn", "starlette", "websockets")):
        return None
    return next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def is_up_to_date(folder: Path = HERE) -> bool:
    """Tell whether every picture is newer than all of the workbench."""
    pictures = [path_of(name, folder) for name in PICTURES]
    if not all(path.is_file() for path in pictures):
        return False
    newest = max(path.stat().st_mtime for path in [Path(__file__), *SOURCE.rglob("*")] if path.is_file())
    return min(path.stat().st_mtime for path in pictures) > newest


def prepare(root: Path) -> None:
    """Put finished jobs and a measured file into a folder."""
    import numpy as np

    import gearrattle as gr
    from gearrattle.workbench.jobs.job_record import Job
    from gearrattle.workbench.kept_results import keep
    from gearrattle.workbench.workspace_folder import Folder

    def job(key: str, name: str, task: str, result: Any, of: gr.Model, **record: Any) -> None:
        times = {"started": "2026-01-01T10:00:00+00:00", "ended": "2026-01-01T10:00:03+00:00"}
        Job(task, name, id=key, state="done", sentence=getattr(result, "sentence", ""), **times, **record).write(
            Folder(root).jobs
        )
        folder = Folder(root).job(key)
        (folder / "model.toml").write_text(of.to_toml(), encoding="utf-8")
        keep(result, folder)

    model = gr.example(MODEL).with_({"simulation.cycles": 60, "simulation.discard": 30})
    findings = gr.run(model)
    job("wide", "Four inertias, as drawn", "run", findings, model)
    axes = {BACKLASH: [f"{0.02 * k:g} mm" for k in range(1, 9)], AMPLITUDE: [f"{40 * k} N*m" for k in range(1, 8)]}
    job("map", "Backlash and torque", "study", gr.study(model, axes, workers=1), model, options={"axes": axes})
    oscillator = gr.example("rattle_oscillator")
    branch = gr.continuation(oscillator, AMPLITUDE, (3.5, 6.5))
    job("branches", "Motions over the torque", "continuation", branch, oscillator)
    motion = findings.motion.trajectory
    noisy = motion.velocity[:, 3] + np.random.default_rng(1).normal(size=len(motion.time))
    part = slice(len(noisy) // 2, None, 2)
    rows = "\n".join(f"{t:.9g},{v:.6g}" for t, v in zip(motion.time[part], noisy[part], strict=True))
    Folder(root).write("rig.csv", f"time [s],output gear [rad/s]\n{rows}\n".encode())


def take(address: str, executable: str, folder: Path) -> None:
    """Take every picture of a server."""
    from playwright.sync_api import sync_playwright

    start, _, token = address.partition("/?token=")
    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        tab = chromium.new_page(viewport=SIZE, color_scheme="light")
        tab.goto(f"{start}/?token={token}")
        for name, (page, sign) in PICTURES.items():
            tab.goto("about:blank")
            tab.goto(f"{start}/{page}")
            tab.wait_for_selector(sign, timeout=120_000)
            _act(name, tab)
            tab.wait_for_load_state("networkidle")
            tab.wait_for_timeout(300)
            tab.screenshot(path=path_of(name, folder), animations="disabled")
        chromium.close()


def _act(name: str, tab: Any) -> None:
    """Do what makes a picture tell more."""
    if name == "editor":
        tab.locator('[data-key="mesh.0"]').first.click()
    elif name == "measured":
        tab.get_by_label("Simulated channel").select_option("velocity.output_gear")
        tab.get_by_role("button", name="1 cycle").click()
    elif name == "branches":
        tab.locator(".gr-motion input").fill("60")
        tab.locator(".gr-motion").evaluate("(el) => el.scrollIntoView({ block: 'start' })")
    elif name == "map":
        tab.get_by_role("tab", name="Map of the impacts per cycle").first.click()
        tab.wait_for_selector(".gr-tabpanel canvas")


def main(folder: Path = HERE) -> bool:
    """Take the pictures; tell whether there are any."""
    executable = browser()
    if executable is None:
        return False
    with tempfile.TemporaryDirectory() as root:
        prepare(Path(root))
        words = [sys.executable, "-m", "gearrattle", "serve", root, "--workers", "1"]
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
            try:
                assert server.stdout is not None
                take(server.stdout.readline().strip(), executable, folder)
            finally:
                server.send_signal(signal.SIGINT)
                server.wait(20)
    return True


class Picture(Figure):
    """``workbench-picture NAME`` with a caption: a figure, or nothing where the picture was not taken."""

    def run(self) -> list[nodes.Node]:
        """Return the figure."""
        settings = self.state.document.settings
        name = self.arguments[0]
        if name not in PICTURES:
            raise self.error(f"{name} is no picture of the workbench; there are {', '.join(PICTURES)}")
        if not path_of(name, Path(settings.env.srcdir) / FOLDER).is_file():
            return []
        self.arguments[0] = f"/{FOLDER}/{path_of(name).name}"
        return list(super().run())


def _take_new(app: Any) -> None:
    """Take the pictures of this manual, unless they are of this workbench."""
    from playwright.sync_api import Error

    try:
        main()
    except (Error, OSError) as error:  # a browser that does not start breaks no manual
        print(f"{app.config.project}: no pictures of the workbench: {error}", file=sys.stderr)


def setup(app: Any) -> dict[str, bool]:
    """Add the directive, and take the pictures before pages are read."""
    app.add_directive("workbench-picture", Picture)
    is_manual = Path(app.srcdir).resolve() == HERE.parent
    if is_manual and browser() is not None and not is_up_to_date():
        app.connect("builder-inited", _take_new)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    main()
