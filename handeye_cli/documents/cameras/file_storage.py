"""The files of OpenCV's FileStorage, in the forms its YAML and XML depart from the standards."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from handeye_cli.documents import text
from handeye_cli.errors import InputError

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_ROOT = "opencv_storage"
_DIRECTIVE = re.compile(rb"\A(?:\xef\xbb\xbf)?%YAML[: ]1\.[0-9][ \t]*\r?\n")
_TAG = re.compile(rb"!!opencv-[a-z-]+")
_APOSTROPHE = re.compile(rb"\\'")
_NOTHING_MORE = re.compile(rb"\n---\s*\Z")
_MAX_DEPTH = 60


def as_yaml(content: bytes) -> bytes:
    """Return a FileStorage's YAML as YAML, lines and columns as they were; other text unchanged.

    Its first line writes the version as no directive is written, its matrices carry a tag that no
    other reader knows, and it escapes apostrophes, which YAML does not. A message that
    `ros2 topic echo` printed ends with the mark of a next one that never comes.
    """
    content = _NOTHING_MORE.sub(b"\n", _DIRECTIVE.sub(b"\n", content, count=1))
    if b"opencv-" not in content:
        return content
    return _APOSTROPHE.sub(b" '", _TAG.sub(lambda match: b" " * len(match[0]), content))


def from_xml(content: bytes, label: str) -> Any:
    """Return the data of a FileStorage's XML as its YAML or JSON would give them.

    Raises:
        InputError: The text is not valid XML, or that of another program.
    """
    from handeye_cli import markup

    root = markup.parse(content, label)
    if root.tag != _ROOT:
        raise InputError(
            f"expected XML of OpenCV's FileStorage, with <{_ROOT}>, found <{root.tag}>", where=label
        )
    return _value(root, label, 0)


def _value(element: Element, label: str, depth: int) -> Any:
    if depth > _MAX_DEPTH:
        message = f"expected at most {_MAX_DEPTH} levels of nesting, found more"
        raise InputError(message, where=label)
    children = list(element)
    if not children:
        words = (element.text or "").split()
        values = [text.resolve(word) for word in words]
        return values[0] if len(values) == 1 and element.tag != "data" else values
    if all(child.tag == "_" for child in children):
        return [_value(child, label, depth + 1) for child in children]
    inside: dict[str, Any] = {}
    for child in children:
        if child.tag in inside:
            raise InputError(f"the key {child.tag!r} was given before", where=label)
        inside[child.tag] = _value(child, label, depth + 1)
    return inside
