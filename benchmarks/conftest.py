"""Prints, after pytest-benchmark's own tables, what the benchmarks are for: ratios."""

from __future__ import annotations

from typing import Any


def pytest_terminal_summary(terminalreporter: Any, config: Any) -> None:
    """Print one line a case: fastest of the rounds, and their ratio."""
    session = getattr(config, "_benchmarksession", None)
    fastest: dict[str, dict[str, float]] = {}
    for timing in session.benchmarks if session else []:
        fastest.setdefault(timing.group, {})[timing.name.split("[")[0]] = timing.stats.min
    tried = {
        (timing.group, timing.name.split("[")[0]): timing.stats.min / timing.extra_info["tried"]
        for timing in (session.benchmarks if session else [])
        if "tried" in timing.extra_info
    }
    for name in sorted({group for group, which in tried if (group, "test_c") in tried and which == "test_kernel"}):
        ours, native = tried[name, "test_kernel"], tried[name, "test_c"]
        terminalreporter.write_line(
            f"{name}: {1e9 * ours:.0f} ns a step tried, in C {1e9 * native:.0f} ns, ratio {ours / native:.2f}"
        )
    pairs = {case: both for case, both in fastest.items() if {"test_exact", "test_midpoint"} <= set(both)}
    if not pairs:
        return
    terminalreporter.section("exact against the fastest plain RK2, h = 0.001/150 s, 127 cycles")
    for case, both in pairs.items():
        exact, fixed = both["test_exact"], both["test_midpoint"]
        terminalreporter.write_line(
            f"{case:<14} RK2 {1e3 * fixed:7.1f} ms   exact {1e3 * exact:7.1f} ms   ratio {fixed / exact:5.2f}"
        )
