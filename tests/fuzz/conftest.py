"""What the fuzz tests share: the command line in this process, and good documents."""

from cli.conftest import handeye
from line.conftest import good, impatient

__all__ = ["good", "handeye", "impatient"]
