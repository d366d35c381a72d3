"""What of a recording could not be read, in numbers that do not grow with the damage."""

from __future__ import annotations

from dataclasses import dataclass

from handeye_cli.errors import InputError


@dataclass
class Losses:
    """Counts of what is damaged, and the first place of it.

    Attributes:
        places: Number of damaged places.
        bytes: Bytes that are not used because of them, as they stand in the file or unpacked.
        messages: Messages that the files count and that were not found.
        cut: Files whose end is missing.
        cut_bytes: Bytes behind the last whole record of those.
        first: File and byte of the first damaged place, and what was found there.
    """

    places: int = 0
    bytes: int = 0
    messages: int = 0
    cut: int = 0
    cut_bytes: int = 0
    first: str = ""

    def add(self, where: str, found: str, size: int) -> None:
        """Count a damaged place.

        Args:
            where: File and byte, for people.
            found: What was found there.
            size: Bytes that are not used because of it.
        """
        if not self.places:
            self.first = f"{where}: {found}"
        self.places += 1
        self.bytes += size


@dataclass
class Unreadable:
    """Messages of a topic that cannot be decoded.

    Attributes:
        first: Why the first of them cannot.
        count: How many there are.
        total: How many messages the topic has.
    """

    first: InputError
    count: int = 0
    total: int = 0
