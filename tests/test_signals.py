"""Ctrl-C, SIGTERM and SIGHUP: one line, the exit status of shells, and nothing left behind."""

import subprocess
import sys
from pathlib import Path

import pytest
from spoilt import listing
from worlds import make_world

from usdface.cli import main

RUN = """
import signal, sys
import usdface.io.usd.layers as layers, usdface.io.staging as staging
from usdface.__main__ import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it in the background
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup ignores it
{patch}
sys.argv[1:] = {arguments}
sys.exit(main())
"""
# While the second of the layers is staged, while files are put in place, and within a library that
# makes another exception of it.
WRITING = """
root = layers._root_layer
def stopped(*given):
    signal.raise_signal({number})
    return root(*given)
layers._root_layer = stopped
"""
MOVING = """
run = staging.Step.run
def stopped(step):
    run(step)
    signal.raise_signal({number})
staging.Step.run = stopped
"""
WRAPPED = """
def wrapped(*given):
    try:
        signal.raise_signal({number})
    except BaseException as error:
        raise ImportError("a library failed to load") from error
layers._root_layer = wrapped
"""
# While a callback of a library in C runs, which cannot pass an exception on.
LOST = """
shot = layers.open_shot
def lost(*given, **more):
    try:
        signal.raise_signal({number})
    except KeyboardInterrupt:
        pass
    return shot(*given, **more)
layers.open_shot = lost
"""


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("signals"))
    named = [f"--rig {folder}/rig.usda --take {folder}/take.usda --bind {folder}/bind.json"]
    assert main(["shot", *named[0].split(), "-o", str(folder / "shot.usda")]) == 0
    return folder / "shot.usda"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "word", "patch"),
    [
        (2, "interrupted", WRITING),
        (1, "hung up", WRITING),
        (15, "terminated", MOVING),
        (15, "terminated", WRAPPED),
        (2, "interrupted", LOST),
    ],
)
def test_a_signal_ends_a_command(shot: Path, number: int, word: str, patch: str) -> None:
    before = listing(shot.parent)
    code = RUN.format(patch=patch.format(number=number), arguments=["process", str(shot)])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.splitlines()[-1] == f"usdface: {word}", done.stderr
    assert "Traceback" not in done.stderr and done.returncode == 128 + number
    after = listing(shot.parent)
    assert not [name for name in after if ".usdface-" in name]
    if patch is MOVING:  # then all of it is there
        assert {"shot.usdface.usda", "shot.usdface/solve.usdc"} <= set(after)
        (shot.parent / "shot.usdface.usda").unlink()
        for layer in (shot.parent / "shot.usdface").iterdir():
            layer.unlink()
        (shot.parent / "shot.usdface").rmdir()
    else:
        assert after == before
