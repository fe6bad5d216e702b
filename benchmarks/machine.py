"""What a measured page says of the machine."""

from __future__ import annotations

import platform
from pathlib import Path


def machine() -> str:
    """Processor, system and interpreter."""
    return f"{_processor()}, {platform.system()}, CPython {platform.python_version()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
