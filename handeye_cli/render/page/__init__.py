"""One page for people: HTML that needs nothing else, from what `reporting` has computed."""
