"""Storm draws what the dock of usdview sets: raw and expressive frames, gains, residual."""

import json
import subprocess
from pathlib import Path

import pytest
from storm import command

pytestmark = pytest.mark.slow
pytest.importorskip("PySide6", reason="PySide6 is not installed: pip install -e '.[qt]'")

SCRIPT = Path(__file__).parent / "storm_pictures.py"
FRAME = 76  # of the example: joy


@pytest.fixture(scope="module")
def differences(example: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, int]:
    """How many of the values of two pictures differ, of 320 x 320 x 3."""
    call = command(SCRIPT, example / "shot.usda", tmp_path_factory.mktemp("pictures"), FRAME)
    if isinstance(call, str):
        pytest.skip(call)
    words, environment = call
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stdout, done.stderr[-2000:]
    found: dict[str, int] = json.loads(done.stdout.splitlines()[-1])
    assert not found.pop("errors")
    return found


def test_the_face_moves_when_the_shot_was_processed(differences: dict[str, int]) -> None:
    assert differences["processed"] > 5000


def test_raw_and_expressive_faces_differ_and_come_back(differences: dict[str, int]) -> None:
    assert differences["expressive_raw"] > 300
    assert differences["expressive_again"] < 30


def test_gains_repaint_the_face(differences: dict[str, int]) -> None:
    """Without any emotion it is the raw face: Storm drew the new weights."""
    assert differences["gains_0_expressive"] > 300
    assert differences["gains_0_raw"] < 30


def test_the_residual_colours_the_skin_and_is_taken_off(differences: dict[str, int]) -> None:
    assert differences["residual"] > 20_000
    assert differences["plain_expressive"] < 30


def test_a_closed_dock_leaves_the_stage_as_it_was(differences: dict[str, int]) -> None:
    assert differences["closed_unprocessed"] < 30
