"""What the numbers of a benchmark depend on."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from handeye_cli import __version__

_PACKAGES = ("numpy", "scipy", "opencv-python-headless", "opencv-python", "mcap", "typer")


def facts() -> dict[str, str]:
    """Return machine and versions, without anything that says whose machine it is."""
    known = {
        "handeye": __version__,
        "system": f"{platform.system()} on {platform.machine()}",
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "Python": platform.python_version(),
    }
    return known | {name: found for name in _PACKAGES if (found := _version(name))}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else "unknown"


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
