"""Records as text for people; nothing is computed here beyond a change of unit."""
