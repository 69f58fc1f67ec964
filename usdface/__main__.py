"""The program: ``usdface`` and ``python -m usdface``."""

import os
import sys
import warnings
from contextlib import suppress

from usdface.signals import handle_signals, ignore_signals, say_stopped, was_stopped

__all__ = ["main"]


def main() -> int:
    """Run the command of the command line; return its exit status, 128 and its number for a signal.

    Signals are handled before anything else is loaded.
    """
    try:
        handle_signals()
        _quiet_libraries()
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


def _quiet_libraries() -> None:
    """Keep words of libraries about damaged files off standard error, where our one line goes."""
    if "--debug" in sys.argv:
        return
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    with suppress(OSError, AttributeError, ValueError):  # there is none
        ours = os.fdopen(os.dup(2), "w", buffering=1, encoding=sys.stderr.encoding)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 2)  # C and C++ write there
        os.close(nowhere)
        sys.stderr = ours


if __name__ == "__main__":
    sys.exit(main())
