"""Follow a document: run its commands in a folder, in order, and compare what they print.

A block of ``sh`` or ``python`` is run; a block of ``text`` after it shows lines of its output, in
their order: ``...`` stands for anything, and numbers may differ by a tenth. A picture of the
document is drawn by whoever follows it, at its place between the commands.
"""

import re
import subprocess
import sys
from collections.abc import Callable
from math import isclose
from pathlib import Path

__all__ = ["follow", "shows"]

_STEP = re.compile(r"^```(\w+)\n(.*?)^```$|!\[[^\]]*\]\((\w+\.png)\)", re.MULTILINE | re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_NEAR = 0.1
_FAILS = "usdface: "  # how the line of an error begins


def follow(document: Path, folder: Path, draw: Callable[[str], None]) -> None:
    """Run the commands of a document in a folder; `draw` gets the name of each picture.

    Raises
    ------
    AssertionError
        If a command fails that should not, or prints something else.
    """
    steps = _STEP.findall(document.read_text(encoding="utf-8"))
    printed = ""
    for number, (language, block, picture) in enumerate(steps):
        after = steps[number + 1] if number + 1 < len(steps) else ("", "", "")
        if picture:
            draw(picture)
        elif language in ("sh", "python"):
            fails = after[0] == "text" and after[1].startswith(_FAILS)
            printed = _run(language, block, folder, fails=fails)
        elif language == "text":
            missing = shows(printed, block)
            assert not missing, (
                f"{document.name} shows {missing!r}, but\n{block}\nprints\n{printed}"
            )


def _run(language: str, block: str, folder: Path, *, fails: bool) -> str:
    commands = f'PATH="{Path(sys.executable).parent}:$PATH"\n{block}'
    program = ["bash", "-ec", commands] if language == "sh" else [sys.executable, "-c", block]
    done = subprocess.run(
        program, cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    )
    assert bool(done.returncode) == fails, f"{block}\n{done.stdout}"
    return done.stdout


def shows(printed: str, block: str) -> str:
    """Return the first line of a block that is not printed, in its order; "" if all are."""
    lines = iter(" ".join(line.split()) for line in printed.splitlines())
    for line in block.splitlines():
        if line.strip() not in ("", "..."):
            wanted = " ".join(line.split())
            if not any(_alike(each, wanted) for each in lines):
                return line
    return ""


def _alike(printed: str, wanted: str) -> bool:
    parts = [_NUMBER.split(part) for part in wanted.split("...")]
    number = f"({_NUMBER.pattern})"
    pattern = ".*".join(number.join(map(re.escape, part)) for part in parts)
    match = re.fullmatch(pattern, printed)
    numbers = _NUMBER.findall(wanted)
    return match is not None and all(
        isclose(float(a), float(b), rel_tol=_NEAR, abs_tol=1e-9)
        for a, b in zip(match.groups(), numbers, strict=True)
    )
