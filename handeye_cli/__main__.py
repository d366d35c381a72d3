"""The `handeye` command as a process, which is also `python -m handeye_cli`."""

from __future__ import annotations


def main() -> None:
    """Run the command; Ctrl-C ends it without a traceback, also while it is still being loaded."""
    try:
        from handeye_cli.cli import app
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    app.main()


if __name__ == "__main__":
    main()
