"""One module for each message schema: `decode` takes a generically decoded message apart."""
