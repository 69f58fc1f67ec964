"""Signals that end a command do so with one line, and unfinished files are removed."""

import signal
import sys
from contextlib import suppress
from types import FrameType

__all__ = ["ENDING_SIGNALS", "handle_signals", "ignore_signals", "say_stopped", "was_stopped"]

_WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
if hasattr(signal, "SIGHUP"):  # the terminal was closed; Windows has none
    _WORDS[signal.SIGHUP] = "hung up"
ENDING_SIGNALS = tuple(_WORDS)
_received: list[int] = []


def handle_signals() -> None:
    """Let them raise KeyboardInterrupt, except those that are ignored (as of nohup)."""
    for number in ENDING_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def ignore_signals() -> None:
    """Ignore them: the remaining work takes milliseconds."""
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def was_stopped() -> bool:
    """Return whether a signal came, also where a library made another exception of it."""
    return bool(_received)


def say_stopped() -> int:
    """Print that a signal ended the program; return its exit status, as shells have it."""
    number = signal.Signals(_received[0] if _received else signal.SIGINT)
    with suppress(OSError):  # as of a closed terminal
        print(f"usdface: {_WORDS[number]}", file=sys.stderr)
    return 128 + number


def _stop(number: int, frame: FrameType | None) -> None:
    _received.append(number)
    raise KeyboardInterrupt
