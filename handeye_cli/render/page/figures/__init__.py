"""The figures of a page, one a file; each takes the axes it is drawn on first."""
