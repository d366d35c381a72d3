"""The command line as the tests of `cli` run it, and what every refusal has in common."""

import signal
import stat

import pytest
from cli.conftest import handeye, shell
from line.good_input import documents_of_the_line

__all__ = ["good", "handeye", "impatient", "refused", "shell"]

SECONDS = 20


class StillRunningError(BaseException):
    """Not an Exception, so that nothing on the way can take it for one."""


@pytest.fixture
def impatient():
    """Stop what waits for something that does not come."""

    def stop(*_):
        raise StillRunningError(f"not done after {SECONDS} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def state_of(folder):
    """What lies in a folder, by name; a file that was written anew is another one."""
    statuses = {path: path.lstat() for path in folder.rglob("*")}
    return {
        path: (status.st_mode, status.st_ino, not stat.S_ISDIR(status.st_mode) and status.st_size)
        for path, status in statuses.items()
    }


@pytest.fixture
def refused(handeye, impatient, tmp_path):
    """Run a command that must fail, and check what every failure has in common."""

    def run(words, code, parts, *, stdin=b"", write=("-o", tmp_path / "out.yaml", "--json")):
        before = state_of(tmp_path)
        done = handeye(*words, *write, stdin=stdin)
        assert (done.code, done.out) == (code, ""), done.err
        error, *hint = done.err.splitlines()
        assert error.startswith("error: ")
        assert [line[:6] for line in hint] in ([], ["hint: "])
        assert "Traceback" not in done.err
        assert [part for part in parts if part not in done.err] == [], done.err
        assert state_of(tmp_path) == before

    return run


@pytest.fixture(scope="session")
def good():
    return documents_of_the_line()
