"""handeye: where a camera sits on a robot, from a recording, and how sure that is.

What is meant for use from Python is listed in `__all__` and loaded when it is first asked for, so
that `import handeye_cli` waits for nothing. `docs/python.md` has examples.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from handeye_cli.lazily import loader

if TYPE_CHECKING:
    from handeye_cli.api import Answers, solve_batch, solve_poses, verify_poses
    from handeye_cli.conventions import Setup
    from handeye_cli.documents import read, write
    from handeye_cli.errors import HandeyeError
    from handeye_cli.records import Calibration, Noise, Stations, Verification

__version__ = "1.0.0"

__all__ = [
    "Answers",
    "Calibration",
    "HandeyeError",
    "Noise",
    "Setup",
    "Stations",
    "Verification",
    "__version__",
    "read",
    "solve_batch",
    "solve_poses",
    "verify_poses",
    "write",
]

_HOMES = {
    "handeye_cli.api": ("Answers", "solve_batch", "solve_poses", "verify_poses"),
    "handeye_cli.conventions": ("Setup",),
    "handeye_cli.documents": ("read", "write"),
    "handeye_cli.errors": ("HandeyeError",),
    "handeye_cli.records": ("Calibration", "Noise", "Stations", "Verification"),
}

__getattr__ = loader(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
