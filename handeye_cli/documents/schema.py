"""Documents against their JSON Schemas, one validator compiled for the kind that is needed."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from handeye_cli.documents.place import Place
from handeye_cli.errors import InputError, did_you_mean

KINDS = (
    "recording",
    "features",
    "stations",
    "calibration",
    "verification",
    "batch",
    "inspection",
    "plan",
    "simulation",
    "truth",
)
"""Every kind of document, in the order of the line."""

_HEADER = re.compile(r"handeye/([^/]*)/([0-9]+)")
_LARGEST = 1e30
"""Far beyond any length or pixel, and small enough that no sum of products overflows."""
_COMMON = "common.schema.json"
_MOST_VALIDATORS = 64
"""Of documents of different keys, kept for the next such document."""
_ANYTHING: dict[str, Any] = {"properties": {}, "dependencies": []}
"""Words of a schema that say something of single keys, with what says nothing there."""


def header(kind: str) -> str:
    """Return the value of `schema:` that a kind of document starts with."""
    return f"handeye/{kind}/1"


def kind_of(data: Any, label: str) -> str:
    """Return the kind a document says it is.

    Args:
        data: The plain data of the document.
        label: Name of the document for error messages.

    Raises:
        InputError: There is no `schema:`, or its kind or version is unknown.
    """
    if not isinstance(data, dict) or "schema" not in data:
        from handeye_cli.documents.complaints import describe

        found = describe(data) if not isinstance(data, dict) else f"the keys {', '.join(data)}"
        raise InputError(
            f"expected a document with a line such as schema: {header('stations')}, found {found}",
            where=label,
            hint=f"kinds: {', '.join(KINDS)}; what another tool has saved: 'handeye import'",
        )
    value = data["schema"]
    where = str(Place(label).key("schema"))
    match = _HEADER.fullmatch(value) if isinstance(value, str) else None
    if not match or match[1] not in KINDS:
        near = did_you_mean(match[1] if match else str(value), list(KINDS))
        hint = f"did you mean {header(near)}?" if near else f"kinds: {', '.join(KINDS)}"
        from handeye_cli.documents.complaints import describe

        message = f"expected handeye/<kind>/1, found {describe(value)}"
        raise InputError(message, where=where, hint=hint)
    if match[2] != "1":
        message = f"expected version 1 of {match[1]}, found version {match[2]}"
        raise InputError(message, where=where, hint="a newer release of handeye may read it")
    return match[1]


def validate(data: Any, kind: str, label: str) -> None:
    """Check a document's plain data against the schema of its kind.

    Args:
        data: The plain data of the document.
        kind: One of `KINDS`.
        label: Name of the document for error messages.

    Raises:
        InputError: The first fault: the key, what was expected and what was found.
    """
    # fastjsonschema takes longer to import than a document takes to read: not before it is used
    from fastjsonschema import JsonSchemaValueException

    try:
        _validator(kind, frozenset(_keys(data)))(data)
    except JsonSchemaValueException:
        from handeye_cli.documents.complaints import complaint

        # the validator that can tell what is wrong is many times as slow to compile
        try:
            _complete_validator(kind)(data)
        except JsonSchemaValueException as error:
            raise complaint(error, data, label) from error
    _require_usable(data, label)


@cache
def folder() -> Path:
    """Return the folder of the schemas: in the installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "schemas"
    return inside if inside.is_dir() else package.parent / "schemas"


@cache
def load(kind: str) -> dict[str, Any]:
    """Return the schema of a kind with the definitions it shares with others in itself."""
    text = (folder() / f"{kind}.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text.replace(_COMMON, ""))
    common = json.loads((folder() / _COMMON).read_text(encoding="utf-8"))
    return schema | {"definitions": common["definitions"] | schema.get("definitions", {})}


@lru_cache(maxsize=_MOST_VALIDATORS)
def _validator(kind: str, keys: frozenset[str]) -> Callable[[Any], Any]:
    """Return the validator of documents of a kind that have only these keys anywhere.

    What a schema says of the values of other keys cannot matter to them; it takes most of the time
    to compile.
    """
    return _compiled(_pruned(load(kind), keys), explains=False)


@cache
def _complete_validator(kind: str) -> Callable[[Any], Any]:
    return _compiled(load(kind), explains=True)


def _compiled(schema: dict[str, Any], *, explains: bool) -> Callable[[Any], Any]:
    import fastjsonschema

    validator: Callable[[Any], Any] = fastjsonschema.compile(
        schema, use_default=False, detailed_exceptions=explains
    )
    return validator


def _keys(data: Any) -> Iterator[str]:
    """Yield every key of a document, many of them again and again."""
    if not isinstance(data, dict | list):
        return
    if isinstance(data, dict):
        yield from data
    for item in data.values() if isinstance(data, dict) else data:
        if isinstance(item, dict | list):
            yield from _keys(item)


def _pruned(schema: Any, keys: frozenset[str]) -> Any:
    """Return a schema without what it says of the values of other keys; they stay allowed."""
    if isinstance(schema, list):
        return [_pruned(each, keys) for each in schema]
    if not isinstance(schema, dict):
        return schema
    pruned = {word: _pruned(rule, keys) for word, rule in schema.items() if word not in _ANYTHING}
    for word in _ANYTHING.keys() & schema.keys():
        rules = schema[word]
        pruned[word] = {
            key: _pruned(rules[key], keys) if key in keys else _ANYTHING[word] for key in rules
        }
    return pruned


def _require_usable(data: Any, label: str) -> None:
    unusable = _find_unusable(data)
    if unusable:
        from handeye_cli.documents.complaints import place_in

        path, value = unusable
        message = f"expected a finite number (of at most {_LARGEST:g}), found {value}"
        raise InputError(message, where=str(place_in(data, path, label)))


def _find_unusable(value: Any) -> tuple[str, float | Decimal] | None:
    """Return the path and value of the first number that is not finite or too large."""
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            found = _find_unusable(item)
            if found:
                step = f".{key}" if isinstance(value, dict) else f"[{key}]"
                return step + found[0], found[1]
    elif isinstance(value, float | Decimal) and not abs(float(value)) <= _LARGEST:
        return "", value
    return None
