"""Tables about the solution."""
