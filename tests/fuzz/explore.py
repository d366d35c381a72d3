"""`python explore.py READER CORPUS... [libFuzzer's flags]`: look for bytes that break a reader.

Needs atheris. It ends with an exit code other than 0 at the first input that raises anything but
an error of bad input, takes too long or too much memory, and leaves that input in a file.
"""

import os
import sys

import atheris

with atheris.instrument_imports(include=["handeye_cli"]):
    from fuzz.readers import READERS

    from handeye_cli.errors import HandeyeError


def main():
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
    reader = READERS[sys.argv[1]]

    def one(data):
        try:
            reader(bytes(data))
        except HandeyeError:
            return

    atheris.Setup([sys.argv[0], *sys.argv[2:]], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
