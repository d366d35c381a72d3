"""XML text into elements, hardened: what a document type declares is never looked at."""

from __future__ import annotations

from typing import NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from handeye_cli.errors import InputError


def parse(data: bytes | str, label: str) -> Element:
    """Return the root element of an XML text.

    A document type is refused before anything in it is read: its entities can stand for more text
    than there is memory, and for files of this machine.

    Args:
        data: The text.
        label: Its name for error messages.

    Raises:
        InputError: The text is not valid XML, or declares a document type.
    """
    parser = ElementTree.XMLParser(target=_PlainBuilder(label))
    try:
        parser.feed(data)
        root = parser.close()
    # an unknown encoding is a LookupError, one that takes more than a byte a ValueError
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError(f"not valid XML: {error}", where=label) from error
    assert isinstance(root, Element)
    return root


class _PlainBuilder(ElementTree.TreeBuilder):
    def __init__(self, label: str) -> None:
        super().__init__()
        self._label = label

    def doctype(self, name: str, _public: str | None, _system: str | None) -> NoReturn:
        """Called where a document type begins."""
        raise InputError(
            f"expected XML without a document type, found <!DOCTYPE {name}",
            where=self._label,
            hint="take the declaration out, with the entities that it declares",
        )
