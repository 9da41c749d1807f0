"""The machine that times were measured on, in one line."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def describe() -> str:
    """Machine in words: processor, cores, operating system, and readiness for real time."""
    return ", ".join(part for part in (_processor(), _cores(), _system()) if part)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _cores() -> str:
    count = os.cpu_count() or 1
    try:
        load = f" under a load of {os.getloadavg()[0]:.1f}"
    except OSError:
        load = ""
    return f"{count} core{'' if count == 1 else 's'}{load}"


def _system() -> str:
    kernel = f"{platform.system()} {platform.release().partition('-')[0]}"
    realtime = Path("/sys/kernel/realtime")
    if platform.system() != "Linux":
        return kernel
    return kernel + (" with real-time patches" if realtime.is_file() else " without real-time patches")
