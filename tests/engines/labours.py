"""Work for other processes: functions of a module that these can import."""

import os
import signal
import time
from pathlib import Path


def by_word(word):
    """Return the word twice, raise what it names, or die of it."""
    if word == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "raise":
        raise KeyError(word)
    return word * 2


def environment(name):
    """Return a variable of the process that is asked."""
    return os.environ.get(name)


def sleep_on(path):
    """Say in a file which process this is, and never come back."""
    Path(path).write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(600)
