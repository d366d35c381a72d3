"""Colours of figures: each stands for a variable of the page, so that it suits light and dark."""

from __future__ import annotations

INK = "#010101"
FAINT = "#010102"
GRID = "#010103"
CARD = "#010104"
BLUE = "#010105"
ORANGE = "#010106"
GREEN = "#010107"
RED = "#010108"

VARIABLES = {
    INK: "var(--ink)",
    FAINT: "var(--faint)",
    GRID: "var(--grid)",
    CARD: "var(--card)",
    BLUE: "var(--blue)",
    ORANGE: "var(--orange)",
    GREEN: "var(--green)",
    RED: "var(--red)",
}
"""What stands in the page's style sheet for each colour that a figure is drawn in."""
