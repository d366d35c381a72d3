"""Findings that tell of errors which are no noise: more stations, or quieter ones, leave them."""

from __future__ import annotations

from collections.abc import Iterable

from handeye_cli.records import Finding

LASTING = "lasting"
"""Code of the improvement that takes such errors away."""
CODES = (
    "plate-bowed",
    "plate-aspect",
    "plate-or-lens",
    "residuals-over-image",
    "robot-systematic",
    "noise-understated",
)
"""Codes of findings for which `solve` adds to the predicted error what no station takes away."""


def codes_of_lasting(findings: Iterable[Finding]) -> list[str]:
    """Return the codes among findings of what adds a lasting part to the predicted error."""
    return [each.code for each in findings if each.code in CODES]
