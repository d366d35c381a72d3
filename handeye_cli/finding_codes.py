"""Codes of findings that later stages act on."""

from __future__ import annotations

INTRINSICS_DOUBTFUL = "intrinsics-doubtful"
"""Intrinsics calibrated from the same images leave a clearly smaller residual than the given."""
