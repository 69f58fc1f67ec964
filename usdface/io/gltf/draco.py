"""Draco data decoded in a process of its own: damaged data may end it, and not us."""

import io
import struct
import subprocess
import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from usdface.errors import InputError
from usdface.io.no_window import NO_WINDOW

__all__ = ["decode_draco"]

_WORKER = Path(__file__).with_name("draco_worker.py")
_TIMEOUT = 300  # [s], for data on which the decoder does not end


def decode_draco(blobs: Sequence[bytes]) -> list[Mapping[str, NDArray[Any]] | None]:
    """Return the arrays of each Draco mesh: ``faces`` (N, 3), and attributes by their unique id.

    None stands for data that cannot be decoded.

    Raises
    ------
    InputError
        If the decoder ends without an answer, or takes too long.
    """
    if not blobs:
        return []
    request = b"".join(struct.pack("<Q", len(blob)) + blob for blob in blobs)
    command = [sys.executable, "-P", str(_WORKER)]
    try:
        done = subprocess.run(
            command,
            input=request,
            capture_output=True,
            timeout=_TIMEOUT,
            creationflags=NO_WINDOW,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(f"the Draco decoder gave no answer: {error}") from error
    try:
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as held:
            arrays = dict(held)
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise InputError("the Draco data are damaged: the decoder ended") from error
    made: list[Mapping[str, NDArray[Any]] | None] = []
    for number in range(len(blobs)):
        start = f"{number}/"
        own = {k.removeprefix(start): v for k, v in arrays.items() if k.startswith(start)}
        made.append(own or None)
    return made
