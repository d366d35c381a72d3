"""Tables about the extraction of target points."""
