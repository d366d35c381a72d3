"""A bare 4x4 matrix, four lines of four numbers with commas, for what reads numbers only."""

from __future__ import annotations

from handeye_cli.documents.exports.numbers import rows_of, words
from handeye_cli.records.named_transform import NamedTransform


def text(transform: NamedTransform) -> str:
    """Return the rows of `parent_T_child`, its translation in metres."""
    return "".join(f"{','.join(words(row))}\n" for row in rows_of(transform.matrix))
