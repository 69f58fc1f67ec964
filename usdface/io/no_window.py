"""Processes without a window of their own."""

import subprocess

__all__ = ["NO_WINDOW"]

# `creationflags` of a process: from a program without a console Windows would show one each time.
NO_WINDOW: int = getattr(subprocess, "CREATE_NO_WINDOW", 0)
