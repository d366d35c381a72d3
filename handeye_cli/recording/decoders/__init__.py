"""One module for each message schema: its definition, and `decode`, which makes it one of ours."""
