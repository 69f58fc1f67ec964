"""A real performance on a real face: AnimFace's optical takes on ICT-FaceKit's head."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ict_face import ict_mesh
from pxr import Usd
from worlds import animation_of

from usdface import assemble_shot, retarget
from usdface.arrays import FloatArray
from usdface.cli import main
from usdface.closure.lip_contact import lip_apertures_of
from usdface.closure.lip_signal import lip_distances
from usdface.geometry.rigid_fit import rigid_fit, similarity_fit
from usdface.io.bind_file import read_bind
from usdface.io.takes.files import read_take
from usdface.io.usd.rig import read_rig
from usdface.retarget.neutral import neutral_markers
from usdface.rigs import Mesh, Rig
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

# Whole takes through all files; the clone of a user lacks them.
pytestmark = pytest.mark.slow

BIND = Path(__file__).resolve().parent / "data" / "animface_ict_bind.json"
# Where the skull shows least of an expression; good enough to tell what the chin does.
HEAD = ("ForeHead_M", "ForeHead_L", "ForeHead_R", "NoseTop", "NoseHead")


class Performance:
    """A take, and what the command line made of it on the ICT face."""

    def __init__(self, rig: Path, source: Path, folder: Path, bind: Path = BIND) -> None:
        take, shot = folder / "take.usdc", folder / "shot.usda"
        self.gltf, self.result = folder / "out.glb", folder / "shot.usdface.usda"
        report = folder / "report.json"
        bound = ["--rig", rig, "--take", take, "--bind", bind]
        for command in (
            ["take", source, "-o", take],
            ["shot", *bound, "-o", shot],
            ["process", shot, "--gltf", self.gltf, "--report", report],
        ):
            assert main([str(word) for word in command]) == 0
        self.report: dict[str, Any] = json.loads(report.read_text())
        recorded, _ = read_take(source)
        assert isinstance(recorded, MarkerTake)
        self.take = recorded
        self.played = animation_of(self.result)
        self.corrected = animation_of(self.result, muted="closure.usdc")
        self.solved = animation_of(self.result, muted="express.usdc")

    def moved(self, marker: str) -> np.ndarray:
        """Return how far a marker is from its neutral once the head is held still: (F, 3) [m]."""
        setup, _ = read_bind(BIND)
        head = self.take.select(HEAD)
        pose, _ = rigid_fit(neutral_markers(head, setup.neutral), head)
        still = pose.to_head(self.take.select((marker,)))
        return still[:, 0] - neutral_markers(still, setup.neutral)[0]


@pytest.fixture(scope="module")
def jaw(ict_rig: Path, shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Performance:
    folder = tmp_path_factory.mktemp("jaw")
    return Performance(ict_rig, shared_data / "animface" / "Jaw.c3d", folder)


@pytest.fixture(scope="module")
def eyebrows(
    ict_rig: Path, shared_data: Path, tmp_path_factory: pytest.TempPathFactory
) -> Performance:
    folder = tmp_path_factory.mktemp("eyebrows")
    return Performance(ict_rig, shared_data / "animface" / "Eyebrows.c3d", folder)


@pytest.mark.parametrize(("name", "frames"), [("jaw", 1590), ("eyebrows", 902)])
def test_the_report_tells_how_well_the_face_follows(
    name: str, frames: int, request: pytest.FixtureRequest
) -> None:
    summary = request.getfixturevalue(name).report["summary"]
    assert (summary["frames"], summary["markers_used"]) == (frames, 41)
    # Another person's face: 41 markers at 1.0 and 1.2 mm in the mean.
    assert 0.5 < summary["residual_mean_mm"] < 1.5
    assert summary["residual_mean_mm"] < summary["residual_max_mm"] < 4.0


def test_the_gltf_is_valid(jaw: Performance, validate_gltf: Callable[[Path], Any]) -> None:
    issues = validate_gltf(jaw.gltf)["issues"]
    assert issues["numErrors"] == 0, issues["messages"][:5]


def test_the_stage_plays_the_weights_that_the_residual_speaks_of(
    ict_rig: Path, shared_data: Path, tmp_path: Path
) -> None:
    """Residual and feature points of the solve layer fit the mesh that the stage shows.

    Markers are kept on their vertices: places beside them are between those that the stage shows.
    """
    bind = tmp_path / "bind.json"
    named = json.loads(BIND.read_text()) | {"solve": {"places": "bound"}}
    bind.write_text(json.dumps(named))
    jaw = Performance(ict_rig, shared_data / "animface" / "Jaw.c3d", tmp_path, bind)
    rig, _ = read_rig(ict_rig)
    setup, _ = read_bind(BIND)
    mesh, points = rig.meshes[0], setup.binding.points
    assert jaw.solved.names == mesh.shape_names
    offsets = mesh.offsets_at(points).reshape(len(mesh.shapes), -1)
    shown = mesh.points[points] + (jaw.solved.weights @ offsets).reshape(-1, len(points), 3)
    stage = Usd.Stage.Open(str(jaw.result))
    prim = stage.GetPrimAtPath("/Shot/Retarget")
    features, residual = (
        np.array([prim.GetAttribute(name).Get(code) for code in jaw.solved.times])
        for name in ("usdface:featurePoints", "usdface:residual")
    )
    rms = np.sqrt(((features - shown) ** 2).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(rms, residual, atol=1e-6)
    assert residual.mean() * 1000 == pytest.approx(jaw.report["summary"]["residual_mean_mm"], 0.01)


@pytest.mark.parametrize("name", ["jaw", "eyebrows"])
def test_a_resting_face_rests_and_no_weight_saturates_for_long(
    name: str, request: pytest.FixtureRequest
) -> None:
    solved = request.getfixturevalue(name).solved
    setup, _ = read_bind(BIND)
    first, last = setup.neutral
    # A blink begins in the last of Eyebrows' neutral frames: a millimetre of both lids.
    assert solved.weights[first:last].max() < 0.1
    assert (solved.weights > 0.999).mean() < 0.01


def test_the_jaw_opens_where_the_chin_goes_down(jaw: Performance) -> None:
    """Of 142 frames in which the chin is down by 40 % of its way, 94 %: else it slides forward."""
    down = -jaw.moved("Chin")[:, 1]
    opened = down > 0.4 * down.max()
    lower_face = [n for n in jaw.solved.names if n.startswith(("jaw", "mouth"))]
    strongest = jaw.solved.reordered(tuple(lower_face)).weights.argmax(axis=1)
    assert opened.sum() > 100
    share = (strongest[opened] == lower_face.index("jawOpen")).mean()
    print(f"jawOpen is the strongest in {100 * share:.0f} % of {opened.sum()} jaw-open frames")
    assert share >= 0.8
    assert np.corrcoef(jaw.solved.column("jawOpen"), down)[0, 1] > 0.9


def test_the_jaw_goes_to_the_side_that_the_chin_goes_to(jaw: Performance) -> None:
    """The performer's left is +X on take and rig."""
    sideways = jaw.moved("Chin")[:, 0]
    left = jaw.solved.column("jawLeft") - jaw.solved.column("jawRight")
    assert left[sideways.argmax()] > 0.5
    assert left[sideways.argmin()] < -0.5


def test_the_jaw_is_forward_where_the_chin_is(jaw: Performance) -> None:
    forward = jaw.moved("Chin")[:, 2]
    assert jaw.solved.column("jawForward")[forward.argmax()] > 0.8


@pytest.mark.parametrize("side", ["L", "R"])
def test_the_brows_go_up_and_down_with_their_markers(eyebrows: Performance, side: str) -> None:
    up = eyebrows.moved(f"{side}eyebrow_M")[:, 1]
    raised = eyebrows.solved.column(f"browOuterUp_{side}")
    raised = raised + eyebrows.solved.column(f"browInnerUp_{side}")
    lowered = eyebrows.solved.column(f"browDown_{side}")
    assert (raised > lowered)[up > 0.4 * up.max()].mean() > 0.9
    assert (lowered > raised)[up < 0.4 * up.min()].mean() > 0.9


def test_the_corrector_only_raises(jaw: Performance) -> None:
    assert (jaw.corrected.weights >= jaw.solved.weights - 1e-6).all()


def test_every_blink_closes_both_eyes_and_a_mistracked_lid_shuts_none(
    jaw: Performance, eyebrows: Performance
) -> None:
    """Frames of the blinks by eye, in the pictures of the markers' curves."""
    for performance, blinks in ((jaw, (59, 323, 999, 1568)), (eyebrows, (24, 101))):
        closings = performance.report["closings"]
        own = [each for each in closings if each["kind"] == "blink"]
        assert len(own) == len(blinks)
        for each, frame in zip(own, blinks, strict=True):
            assert abs(each["peak"] - frame) <= 2 and each["eyes"] == ["left", "right"]
            # Contact is what closes an eye; where a squint narrows it, at a lower weight.
            assert min(each["weight_after"]) > 0.93 and max(each["gap_mm"]) < 1.1
            assert max(each["weight_before"]) < 0.35
        # In Eyebrows the marker of the right lid goes up in a frown; the left eye is not held shut.
        assert len(own) == len(closings)


def test_blinks_close_where_both_lid_markers_are_bound_three_millimetres_too_low(
    ict_rig: Path, shared_data: Path, tmp_path: Path
) -> None:
    bind = json.loads(BIND.read_text())
    bind["markers"] |= {"Leye_Up": {"point": 2922}, "Reye_Up": {"point": 681}}
    low = tmp_path / "bind.json"
    low.write_text(json.dumps(bind))
    take = Performance(ict_rig, shared_data / "animface" / "Jaw.c3d", tmp_path, low)
    closings = take.report["closings"]
    assert [each["kind"] for each in closings].count("blink") == 4
    assert min(min(each["weight_after"]) for each in closings) > 0.93


def test_a_frown_crosses_no_eyes(eyebrows: Performance) -> None:
    """It draws the skin around the eyes inwards, as eyes that look inwards do."""
    played = eyebrows.played
    for left, right in (("In", "Out"), ("Out", "In"), ("Up", "Up"), ("Down", "Down")):
        apart = played.column(f"eyeLook{left}_L") - played.column(f"eyeLook{right}_R")
        assert np.abs(apart).max() < 0.25


def test_lips_that_touch_are_not_left_open(jaw: Performance) -> None:
    """The jaw goes sideways with the lips closed; solved they part by up to 7 mm."""
    opened = jaw.played.column("jawOpen")[700:1500]
    assert (opened <= jaw.solved.column("jawOpen")[700:1500] + 1e-6).all()
    assert jaw.report["summary"]["frames_with_closed_lips"] > 300


def test_the_binding_is_symmetric_and_lies_on_the_skin_where_the_performer_has_markers(
    jaw: Performance, ict_rig: Path
) -> None:
    setup, _ = read_bind(BIND)
    rig, _ = read_rig(ict_rig)
    bound = rig.meshes[0].points[setup.binding.points]
    assert setup.binding.points.max() < 9409  # eyes, teeth, mouth and skull come after the face
    gaps = np.linalg.norm(bound[:, None] - bound * [-1, 1, 1], axis=2)
    assert gaps.min(axis=1).max() < 1e-4
    worn = jaw.take.select(setup.binding.markers)[setup.neutral[0]]
    linear, offset = similarity_fit(worn, bound)
    apart = np.linalg.norm(worn @ linear + offset - bound, axis=1)
    assert apart.max() < 0.015
    assert np.sqrt((apart**2).mean()) < 0.007


@pytest.mark.parametrize("kept", [slice(0, -2), slice(2, None)])
def test_two_frames_fewer_change_no_weight_much(shared_data: Path, kept: slice) -> None:
    """No decision about markers and their places may hang on a frame (0.19 where some did)."""
    rig = Rig("Face", (ict_mesh(shared_data),))
    setup = replace(read_bind(BIND)[0], origin=None)
    whole, _ = read_take(shared_data / "animface" / "Eyebrows.c3d")
    assert isinstance(whole, MarkerTake) and setup.neutral is not None
    first = kept.start or 0
    times = whole.times[kept] - whole.times[first]
    part = replace(whole, times=times, positions=whole.positions[kept])
    weights = []
    for take, begin in ((whole, 0), (part, first)):
        neutral = (setup.neutral[0] - begin, setup.neutral[1] - begin)
        shot, _ = assemble_shot(rig, take, setup=replace(setup, neutral=neutral))
        weights.append(retarget(shot).weights.weights)
    assert np.abs(weights[0][kept] - weights[1]).max() < 0.06


def test_no_eye_droops_in_and_after_a_frown(shared_data: Path, eyebrows: Performance) -> None:
    """The left one was up to 0.37 shut while its lid's marker was dragged down by the brow."""
    shut = [eyebrows.played.names.index(f"eyeBlink_{side}") for side in "LR"]
    left, right = eyebrows.played.weights[545:, shut].T
    assert np.abs(left - right).max() < 0.1
    take, _ = read_take(shared_data / "animface" / "Eyebrows.c3d")
    assert isinstance(take, MarkerTake)
    slow = replace(take, times=take.times[::2], positions=take.positions[::2], rate=30.0)
    by_names = retarget(assemble_shot(Rig("Face", (ict_mesh(shared_data),)), slow)[0])
    shut = [by_names.weights.names.index(f"eyeBlink_{side}") for side in "LR"]
    left, right = by_names.weights.weights[272:, shut].T
    assert np.abs(left - right).max() < 0.1


def lips_of(
    mesh: Mesh, take: MarkerTake, setup: RetargetSetup | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how far the lips are open as solved and as closed, and the markers apart: (F,) [m]."""
    shot = assemble_shot(Rig("Face", (mesh,)), take, setup=setup)[0]
    result = retarget(shot)
    lips = lip_apertures_of(shot.face, result.solved.names)
    assert lips is not None and result.solution is not None and result.closure is not None
    seen = lip_distances(shot.face, result.solved, result.solution, lips.across, lips.x)
    assert seen is not None
    solved, closed = (
        lips.opened(each).max(axis=1) for each in (result.solved.weights, result.closure.weights)
    )
    return solved, closed, seen.seen.max(axis=1)


def test_lips_close_also_with_places_set_by_hand(shared_data: Path) -> None:
    take, _ = read_take(shared_data / "animface" / "Jaw.c3d")
    assert isinstance(take, MarkerTake)
    by_hand = read_bind(BIND)[0]
    solved, closed, apart = lips_of(ict_mesh(shared_data), take, by_hand)
    touch = apart < 0.0005
    assert solved[touch].max() > 0.003
    assert closed[touch].max() < 0.001


@pytest.mark.parametrize("every", [1, 2])
def test_lips_close_where_the_performers_touch(shared_data: Path, every: int) -> None:
    """Bound by names: the solve rolls the lips open to follow markers that are as near as at rest.

    They do not open and close faster than as solved or as the markers by half a millimetre.
    """
    take, _ = read_take(shared_data / "animface" / "Jaw.c3d")
    assert isinstance(take, MarkerTake)
    take = replace(
        take,
        times=take.times[::every],
        positions=take.positions[::every],
        rate=take.rate / every,
    )
    solved, closed, apart = lips_of(ict_mesh(shared_data), take)
    touch = apart < 0.0005
    assert closed[touch].max() < min(0.001, 0.25 * solved[touch].max())
    wide = apart > 0.005
    np.testing.assert_allclose(closed[wide], solved[wide], atol=1e-6)
    own, others = np.abs(np.diff(closed)), np.abs(np.diff(np.stack([solved, apart]), axis=1))
    assert (own - others.max(axis=0)).max() < 0.0005
