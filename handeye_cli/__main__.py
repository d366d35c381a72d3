"""`python -m handeye_cli` is the `handeye` command."""

from handeye_cli.cli.app import main

if __name__ == "__main__":
    main()
