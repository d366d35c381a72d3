"""The `handeye` command: read, one stage, write, show. Only this package prints or exits."""
