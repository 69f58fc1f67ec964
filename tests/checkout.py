"""Processes of their own that import usdface from this checkout, not an installed one."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

__all__ = ["CHECKOUT", "environment", "run_usdface"]

CHECKOUT = Path(__file__).resolve().parents[1]


def environment(*folders: Path, **changes: str) -> dict[str, str]:
    """Return the variables of a process that finds this checkout and modules of some folders.

    The folders come first: they may replace a package. Those of the tests' own `PYTHONPATH` follow.
    """
    paths = [*map(str, folders), str(CHECKOUT), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))} | changes


def run_usdface(
    *words: object, folders: Sequence[Path] = (), cwd: Path | None = None, **changes: str
) -> subprocess.CompletedProcess[bytes]:
    """Run the command line; `changes` are environment variables.

    Its output is bytes, since a test may ask for another encoding than its own.
    """
    arguments = [word if isinstance(word, bytes) else str(word) for word in words]
    return subprocess.run(
        [sys.executable, "-m", "usdface", *arguments],
        env=environment(*folders, **changes),
        cwd=cwd,
        capture_output=True,
        check=False,
    )
