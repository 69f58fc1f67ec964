"""Ctrl-C and SIGTERM end a command with one line, and unfinished files are removed."""

import signal
import sys
from types import FrameType

__all__ = ["handle_signals", "ignore_signals", "say_stopped", "was_stopped"]

_NUMBERS = (signal.SIGINT, signal.SIGTERM)
_WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
_received: list[int] = []


def handle_signals() -> None:
    """Let both signals raise KeyboardInterrupt, except where they are ignored (as of nohup)."""
    for number in _NUMBERS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def ignore_signals() -> None:
    """Ignore both signals: the remaining work takes milliseconds."""
    for number in _NUMBERS:
        signal.signal(number, signal.SIG_IGN)


def was_stopped() -> bool:
    """Return whether a signal came, also where a library made another exception of it."""
    return bool(_received)


def say_stopped() -> int:
    """Print that a signal ended the program; return its exit status, as shells have it."""
    number = signal.Signals(_received[0] if _received else signal.SIGINT)
    print(f"usdface: {_WORDS[number]}", file=sys.stderr)
    return 128 + number


def _stop(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    raise KeyboardInterrupt
