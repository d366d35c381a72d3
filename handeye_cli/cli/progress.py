"""How far the work on the pictures is, on stderr, for people only."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from handeye_cli.cli.options import Intrinsics, Output, Work

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from handeye_cli.pipeline import Steps


@contextmanager
def steps(work: Work, output: Output, intrinsics: Intrinsics | None = None) -> Iterator[Steps]:
    """Yield how the stages are run, with a progress bar where a person looks on.

    Args:
        work: Flags about how the work is shared out.
        output: Flags about how much is said.
        intrinsics: Flags about the camera, for the commands that have them.
    """
    from handeye_cli.pipeline import Steps

    calibrate = intrinsics is not None and intrinsics.calibrate_intrinsics
    shown = sys.stderr.isatty() and not output.quiet
    with ExitStack() as stack:
        progress = _progress(stack) if shown else None
        yield Steps(workers=work.workers, progress=progress, calibrate_intrinsics=calibrate)


def _progress(stack: ExitStack) -> Callable[[int, int], None]:
    """Return what shows the progress: a bar that appears with the first picture that is done."""

    @functools.cache
    def bar() -> Progress:
        from rich.console import Console
        from rich.progress import Progress

        return stack.enter_context(Progress(console=Console(stderr=True), transient=True))

    @functools.cache
    def task(total: int) -> TaskID:
        return bar().add_task("pictures", total=total)

    return lambda done, total: bar().update(task(total), completed=done)
