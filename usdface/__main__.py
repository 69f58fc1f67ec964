"""The program: ``usdface`` and ``python -m usdface``."""

import sys

from usdface.signals import handle_signals, ignore_signals, say_stopped, was_stopped

__all__ = ["main"]


def main() -> int:
    """Run the command of the command line; return its exit status, 130 and 143 for signals.

    Signals are handled before anything else is loaded.
    """
    try:
        handle_signals()
        from usdface.cli import main as run

        status = run()
        ignore_signals()
    except KeyboardInterrupt:
        ignore_signals()
        return say_stopped()
    except Exception:
        if not was_stopped():
            raise
        return say_stopped()
    return status


if __name__ == "__main__":
    sys.exit(main())
