"""Where in a document something stands, in words for people."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Place:
    """A key of a document, such as `poses.yaml: stations[2].base_T_gripper (station "07")`.

    Attributes:
        file: Name of the document.
        path: Keys and indices that lead to the place, empty for the whole document.
        station: Name of the station it belongs to, when it has one.
    """

    file: str
    path: str = ""
    station: str | None = None

    def key(self, name: str) -> Place:
        """Return the place of a key below this one."""
        return replace(self, path=f"{self.path}.{name}" if self.path else name)

    def item(self, index: int) -> Place:
        """Return the place of an item of the list that stands here."""
        return replace(self, path=f"{self.path}[{index}]")

    def of_station(self, name: str) -> Place:
        """Return the same place, said to belong to a station."""
        return replace(self, station=name)

    def __str__(self) -> str:
        path = f": {self.path}" if self.path else ""
        station = f' (station "{self.station}")' if self.station else ""
        return f"{self.file}{path}{station}"
