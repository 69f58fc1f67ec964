"""Functions that workers of the tests call, in processes of their own."""

import os
import signal
import time
from typing import Any

from usdface.errors import InputError

__all__ = ["work"]


def work(task: str) -> Any:
    """Do what the task is named."""
    if task == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if task == "exit":
        os._exit(7)
    if task == "hang":
        time.sleep(600)
    if task == "refuse":
        raise InputError("no such face", "FACE_MISSING")
    if task == "fault":
        raise ZeroDivisionError("by nothing")
    if task == "print":
        print("words of a library")
    return os.getpid() if task == "who" else task
