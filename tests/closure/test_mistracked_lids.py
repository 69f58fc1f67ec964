"""A lid's marker that opens the eye further than a lid can takes the word of the other lid."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from closing_world import TIMES, markers, performance, result, slit_markers
from ict_face import ict_mesh
from slits import slit_face

from usdface import ProcessOptions, assemble_shot, read_bind, read_take, retarget
from usdface.closure.lid_apertures import lid_apertures_of
from usdface.closure.mistracked_lids import _certainty, lid_pairs, lid_reach, mistracked_lids
from usdface.options import CleanOptions
from usdface.rigs import Rig
from usdface.shot.shot import ShotResult
from usdface.takes import MarkerTake

MESH = slit_face()
NAMES = MESH.shape_names
# A course that rises and falls between the two blinks.
COURSE = np.clip(np.minimum((TIMES - 1.5) / 0.2, (2.3 - TIMES) / 0.2), 0, 1)
LOST = (TIMES > 1.65) & (TIMES < 2.15)


def lost(take: MarkerTake, marker: str = "eye_right_up", rise: float = 0.012) -> MarkerTake:
    """Return the take with a marker that wanders up [m] while it is lost."""
    positions = take.positions.copy()
    positions[:, take.names.index(marker), 1] += rise * COURSE
    return MarkerTake(take.names, take.times, positions, take.rate)


def codes(shot: ShotResult) -> list[str]:
    return [finding.where for finding in shot.findings if finding.code == "LID_DISBELIEVED"]


@pytest.mark.slow
def test_a_lost_marker_moves_as_the_other_lid_and_is_named() -> None:
    """A half closed eye that the lost marker would show wide open."""
    squint = {f"eyeBlink{side}": 0.5 * COURSE for side in ("Left", "Right")}
    take = markers(MESH, performance(NAMES, **squint))
    clean = CleanOptions(swaps=False, spikes=True, gaps=False)
    shot = result(lost(take), clean=clean)
    assert codes(shot) == ["eye_right_up"]
    right, left = (shot.solved.column(f"eyeBlink{side}")[LOST] for side in ("Right", "Left"))
    np.testing.assert_allclose(right, left, atol=0.1)
    assert left.mean() == pytest.approx(0.5, abs=0.1)
    assert shot.solved.column("eyeWideRight")[LOST].max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    "curves",
    [
        {"eyeBlinkLeft": COURSE},  # a wink
        {"eyeWideLeft": COURSE, "eyeWideRight": COURSE},
        pytest.param({"eyeWideRight": COURSE}, marks=pytest.mark.slow),
        pytest.param({"eyeBlinkLeft": COURSE, "browInnerUp": COURSE}, marks=pytest.mark.slow),
        {"eyeBlinkLeft": COURSE, "eyeWideRight": 0.3 * COURSE},
    ],
)
def test_winks_and_wide_eyes_are_certainty(curves: dict[str, np.ndarray]) -> None:
    take = markers(MESH, performance(NAMES, **curves))
    shot = result(take)
    assert codes(shot) == []
    for name, curve in curves.items():
        seen = shot.solved.column(name)[LOST]
        np.testing.assert_allclose(seen, curve[LOST], atol=0.15)


@pytest.mark.slow
def test_both_lids_that_rise_are_certainty() -> None:
    """Such a face is another one than the rig, not a lost marker."""
    take = markers(MESH, performance(NAMES))
    shot = result(lost(lost(take), "eye_left_up"))
    assert codes(shot) == []


def test_a_marker_that_closed_lids_hardly_move_is_not_judged() -> None:
    """It is beside the lid: raised brows move it further than lids do."""
    own = slit_markers(MESH)
    lids = [own[f"eye_{side}_{lid}"] for side in ("left", "right") for lid in ("up", "in")]

    def judged(share: float) -> int:
        shapes = []
        for shape in MESH.shapes:
            less = np.isin(shape.indices, lids) & shape.name.startswith("eyeBlink")
            factor = np.where(less, share, 1.0)[:, None]
            shapes.append(replace(shape, offsets=factor * shape.offsets))
        mesh = replace(MESH, shapes=tuple(shapes))
        shot = result(markers(MESH, performance(NAMES)), mesh=mesh)
        assert shot.solution is not None
        face = shot.shot.face.with_contacts()
        return len(lid_pairs(face, shot.solution, lid_apertures_of(face, NAMES)))

    assert judged(1.0) == 4
    assert judged(0.2) == 0


def test_it_leaves_a_take_alone_that_is_not_cleaned() -> None:
    take = lost(markers(MESH, performance(NAMES)))
    clean = CleanOptions(swaps=False, spikes=False, gaps=False)
    assert codes(result(take, clean=clean)) == []


def test_a_face_without_lids_has_nothing_to_disbelieve() -> None:
    without = tuple(shape for shape in MESH.shapes if not shape.name.startswith("eyeBlink"))
    shot = result(lost(markers(MESH, performance(NAMES))), mesh=replace(MESH, shapes=without))
    assert shot.solution is not None
    assert isinstance(shot.shot.take, MarkerTake)
    face = shot.shot.face
    lids = lid_apertures_of(face, shot.solution.weights.names)
    assert mistracked_lids(shot.shot.take, face, shot.solution, lids, 9) == ()


def test_a_frame_is_judged_by_those_within_reach_alone() -> None:
    """So a piece of a take with this much around it is judged as the whole."""
    chance, reach, frames = np.random.default_rng(2), 20, 400
    where = chance.random(frames) > 0.03
    certain = where & (chance.random(frames) > 0.98)
    whole = _certainty(where, certain, reach)
    assert 0.0 < whole.min(initial=1.0, where=whole > 0.0) < 0.5 and whole.max() == 1.0
    assert not whole[~where].any() and (whole[certain] == 1.0).all()
    for frame in range(frames):
        near = slice(max(0, frame - reach), frame + reach + 1)
        piece = _certainty(where[near], certain[near], reach)
        assert piece[frame - near.start] == whole[frame]


def test_the_reach_is_five_seconds() -> None:
    assert lid_reach(np.arange(9) / 30.0) == 150
    assert lid_reach(np.zeros(1)) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lost_markers"), [("Eyebrows", ["Reye_Up"]), ("Jaw", [])])
def test_in_a_real_frown_no_eye_closes_alone(
    shared_data: Path, name: str, lost_markers: list[str]
) -> None:
    take, _ = read_take(shared_data / "animface" / f"{name}.c3d")
    bind, _ = read_bind(Path(__file__).parents[1] / "data" / "animface_ict_bind.json")
    shot, _ = assemble_shot(Rig("Face", (ict_mesh(shared_data),)), take, setup=bind)
    shown = retarget(shot, options=ProcessOptions(express=False))
    assert codes(shown) == lost_markers
    left, right = (shown.weights.column(f"eyeBlink_{side}") for side in "LR")
    assert np.abs(left - right).max() < 0.35
    assert {closing.closing.kind for closing in shown.closure.closings} == {"blink"}
