"""What a report shows: documents that belong together, what they lack, and what it all comes to."""
