"""USD's own exceptions as one clear line."""

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Tf, UsdUtils

from usdface.errors import InputError

__all__ = ["one_line", "usd_errors", "usd_message"]

_LONGEST = 400  # characters


def usd_message(error: Exception) -> str:
    """Return the message of a USD exception in one line, without its C++ context."""
    try:
        # Of several errors the first is the cause.
        messages = [e.commentary for e in error.args if isinstance(e, Tf.Error)] or [str(error)]
    except UnicodeError:  # the message quotes bytes of a damaged file
        return "a name in it is not UTF-8"
    return one_line(messages[0])


def one_line(messages: str) -> str:
    """Return the first line of a message of USD, shortened where it quotes at length."""
    lines = [line.strip() for line in messages.splitlines() if line.strip()]
    first = lines[0] if lines else "unknown error"
    return first if len(first) <= _LONGEST else f"{first[:_LONGEST]}..."


@contextmanager
def usd_errors(source: str) -> Iterator[None]:
    """Raise as InputError, naming `source`, any error while a stage is read.

    USD's own warnings are kept off standard error, where our one line goes.
    A damaged file fails late: USD reads values when they are requested, and names that are
    not UTF-8 or values of another type than their schema's fail in Python.
    """
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    except InputError as error:
        raise (
            error if source in str(error) else InputError(f"{source}: {error}", error.code)
        ) from error
    except Tf.ErrorException as error:
        raise InputError(
            f"{source} cannot be read as USD: {usd_message(error)}", "FILE_UNREADABLE"
        ) from error
    except UnicodeError as error:
        raise InputError(f"{source} holds a name that is not UTF-8", "SCHEMA_BROKEN") from error
    except (MemoryError, OverflowError, RuntimeError, TypeError, ValueError) as error:
        message = f"{source} does not follow USD's schemas: {usd_message(error)}"
        raise InputError(message, "SCHEMA_BROKEN") from error
    finally:
        del delegate
