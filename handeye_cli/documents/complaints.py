"""What a schema's validator found, in words for people."""

from __future__ import annotations

import re
from decimal import Decimal
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError, did_you_mean

if TYPE_CHECKING:
    from fastjsonschema import JsonSchemaValueException

_TYPES = {
    "number": "a number",
    "integer": "a whole number",
    "string": "a text",
    "boolean": "true or false",
    "array": "a list",
    "object": "a mapping",
}
_LONGEST = 60


def describe(value: Any) -> str:
    """Return a found value in a few words."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float | Decimal):
        return f"the number {value}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return f"a mapping with the keys {_shortened(', '.join(value))}" if value else "no keys"
    return repr(_shortened(str(value)))


def complaint(error: JsonSchemaValueException, data: Any, label: str) -> InputError:
    """Return the error a user reads for the first fault a validator met.

    Args:
        error: The fault.
        data: The whole document.
        label: Name of the document.
    """
    place = place_in(data, (error.name or "").removeprefix("data"), label)
    definition = error.definition if isinstance(error.definition, dict) else {}
    unknown = _unknown_keys(error.value, definition)
    if unknown:
        return _unknown_key(unknown[0], sorted(definition["properties"]), place)
    return InputError(
        f"expected {_expected(error, definition)}, found {describe(error.value)}",
        where=str(place),
        hint=_hint(error),
    )


def place_in(data: dict[str, Any], path: str, label: str) -> Place:
    """Return the place of a path such as `.stations[2].image`, with the name of its station."""
    path = path.removeprefix(".")
    return Place(label, path, _station(path, data))


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def _station(path: str, data: dict[str, Any]) -> str | None:
    match = re.match(r"stations\[([0-9]+)\]", path)
    station = data["stations"][int(match[1])] if match else None
    if not isinstance(station, dict):
        return None
    image = station.get("image")
    stem = PurePosixPath(image).stem if isinstance(image, str) else None
    name = station.get("name", stem)
    return name if isinstance(name, str) else None


def _unknown_keys(value: Any, definition: dict[str, Any]) -> list[str]:
    if not isinstance(value, dict) or definition.get("additionalProperties") is not False:
        return []
    return [key for key in value if key not in definition["properties"]]


def _unknown_key(key: str, known: list[str], place: Place) -> InputError:
    near = did_you_mean(key, known)
    hint = f"did you mean {near!r}?" if near else f"known keys: {', '.join(known)}"
    return InputError(f"unknown key {key!r}", where=str(place.key(key)), hint=hint)


def _expected(error: JsonSchemaValueException, definition: dict[str, Any]) -> str:
    if error.rule == "required":
        missing = [key for key in definition["required"] if key not in error.value]
        return f"the key {missing[0]!r}"
    if error.rule == "dependencies":
        return _expected_companion(error.value, definition["dependencies"])
    if error.rule == "enum":
        return f"one of {', '.join(definition['enum'])}"
    if "description" in definition:
        return str(definition["description"])
    if error.rule == "type":
        return _TYPES[definition["type"]]
    return "a text that is not empty" if error.rule == "minLength" else error.message


def _expected_companion(value: dict[str, Any], dependencies: dict[str, Any]) -> str:
    for key, companions in dependencies.items():
        if key in value and isinstance(companions, list):
            missing = [name for name in companions if name not in value]
            if missing:
                return f"the key {missing[0]!r} beside {key!r}"
    return "other keys"


def _hint(error: JsonSchemaValueException) -> str | None:
    if error.rule != "enum" or not isinstance(error.value, str):
        return None
    near = did_you_mean(error.value, list(error.definition["enum"]))
    return f"did you mean {near}?" if near else None
