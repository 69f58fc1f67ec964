"""The verdict on the example's take, as it is and spoilt: each spoiling is told by its own reason.

`python -m benchmarks.verdict` does the same on real takes and other people's faces.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree
from worlds import make_world

import usdface
from usdface.options import CleanOptions, ProcessOptions, SolveOptions
from usdface.rigs import Rig
from usdface.setup.binding import Binding
from usdface.shot.measures import shot_measures
from usdface.shot.report import report_of
from usdface.shot.shot import Shot
from usdface.takes import MarkerTake
from usdface.verdict import Verdict

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FRAMES = slice(0, 130)


@pytest.fixture(scope="module")
def shot() -> Shot:
    rig, _ = usdface.read_rig(EXAMPLES / "head.usdc")
    take, _ = usdface.read_take(EXAMPLES / "take.usdc")
    setup, _ = usdface.read_bind(EXAMPLES / "bind.json")
    cut = take.with_frames(FRAMES)
    return usdface.assemble_shot(rig, cut, setup=setup)[0]


def verdict_on(shot: Shot) -> Verdict:
    options = ProcessOptions(express=False, closure=False)
    verdict = report_of(usdface.retarget(shot, options=options)).verdict
    assert verdict is not None
    return verdict


def with_positions(shot: Shot, positions: np.ndarray) -> Shot:
    assert isinstance(shot.take, MarkerTake)
    return replace(shot, take=replace(shot.take, positions=positions))


def with_vertices(shot: Shot, vertices: np.ndarray) -> Shot:
    binding = replace(shot.setup.binding, points=vertices)
    return replace(shot, setup=replace(shot.setup, binding=binding))


def codes(verdict: Verdict) -> list[str]:
    return [reason.criterion.code for reason in verdict.reasons]


@pytest.mark.slow
def test_a_good_take_is_good(shot: Shot) -> None:
    assert verdict_on(shot) == Verdict("good")


@pytest.mark.slow
def test_mirrored_labels_are_not_usable(shot: Shot) -> None:
    points, vertices = shot.mesh.points, shot.setup.binding.points
    across = cKDTree(points).query(points[vertices] * [-1, 1, 1])[1]
    verdict = verdict_on(with_vertices(shot, across))
    assert verdict.level == "not_usable" and codes(verdict)[0] == "SIDES_MIRRORED"


@pytest.mark.slow
def test_a_rig_without_some_shapes_is_to_be_looked_at(shot: Shot) -> None:
    without = tuple(s for s in shot.mesh.shapes if not s.name.startswith(("mouth", "jaw")))
    assert len(without) < len(shot.mesh.shapes)
    verdict = verdict_on(replace(shot, rig=Rig("face", (replace(shot.mesh, shapes=without),))))
    assert verdict.level == "look_at" and "MOTION_BEYOND_SHAPES" in codes(verdict)
    markers = verdict.reasons[codes(verdict).index("MOTION_BEYOND_SHAPES")].measured.where
    assert all(name.startswith(("lip", "chin", "jaw")) for name in markers)


@pytest.mark.slow
def test_a_head_that_is_not_taken_out_is_no_motion_of_the_face(shot: Shot) -> None:
    setup = replace(shot.setup, head="stabilised")
    assert verdict_on(replace(shot, setup=setup)).level == "not_usable"


def test_one_marker_on_a_wrong_vertex_is_named(shot: Shot) -> None:
    """It hardly raises the misfit of all, and the solve of the others is as good."""
    binding = shot.setup.binding
    lip, nose = (binding.markers.index(name) for name in ("lip_upper", "nose_tip"))
    vertices = binding.points.copy()
    vertices[lip] = vertices[nose]
    verdict = verdict_on(with_vertices(shot, vertices))
    assert codes(verdict) == ["PLACE_WRONG"]
    assert verdict.reasons[0].measured.where == ("lip_upper",)


@pytest.mark.slow
def test_exchanged_places_are_not_usable_and_named(shot: Shot) -> None:
    binding = shot.setup.binding
    wrong = ["brow_left_outer", "chin", "cheek_right_outer", "lip_corner_left"]
    rows = [binding.markers.index(name) for name in wrong]
    vertices = binding.points.copy()
    vertices[rows] = vertices[np.roll(rows, 1)]
    verdict = verdict_on(with_vertices(shot, vertices))
    assert verdict.level == "not_usable" and "PLACES_MISFIT" in codes(verdict)
    named = verdict.reasons[codes(verdict).index("PLACES_MISFIT")].measured.where
    assert set(wrong) & set(named)


@pytest.mark.slow
def test_a_wrong_unit_is_to_be_looked_at(shot: Shot) -> None:
    verdict = verdict_on(with_positions(shot, 10.0 * shot.take.positions))
    assert verdict.level == "look_at"
    (reason,) = verdict.reasons
    assert reason.criterion.code == "TAKE_SIZE"
    assert reason.measured.where == ("large",)
    assert reason.measured.value == pytest.approx(10, rel=0.2)


@pytest.mark.slow
def test_a_neutral_that_is_none_is_found(shot: Shot) -> None:
    peak = 97  # of the first expression
    verdict = verdict_on(replace(shot, setup=replace(shot.setup, neutral=(peak, peak))))
    # The solve finds what it shows, as far as it takes it off.
    assert verdict.level != "good" and "NEUTRAL_AT_LIMIT" in codes(verdict)
    given = replace(shot.setup, neutral=(peak, peak), solve=SolveOptions(neutral="given"))
    verdict = verdict_on(replace(shot, setup=given))
    assert verdict.level != "good" and "NEUTRAL_EXPRESSIVE" in codes(verdict)


@pytest.mark.slow
def test_an_expression_that_is_named_as_the_neutral_is_none_too_many(shot: Shot) -> None:
    peak = 97
    solved = usdface.retarget(shot, options=ProcessOptions(express=False, closure=False)).weights
    named = dict(zip(solved.names, np.clip(solved.weights[peak], 0, 1).tolist(), strict=True))
    setup = replace(shot.setup, neutral=(peak, peak), neutral_weights=named)
    assert "NEUTRAL_EXPRESSIVE" not in codes(verdict_on(replace(shot, setup=setup)))


@pytest.mark.slow
def test_noise_larger_than_the_motion_is_not_usable(shot: Shot) -> None:
    noise = np.random.default_rng(1).normal(size=shot.take.positions.shape)
    verdict = verdict_on(with_positions(shot, shot.take.positions + 0.008 * noise))
    assert verdict.level == "not_usable" and codes(verdict)[0] == "NOISE_LARGE"


def test_a_marker_that_is_seen_without_a_pose_alone_hides_no_other_that_is_astray() -> None:
    """Its distance is unknown: the neutral frame that shows it lacks two of the head markers."""
    world, rigid = make_world(), ("temple_l", "temple_r", "forehead", "bridge")
    names = world.take.names
    positions = world.take.positions.copy()
    positions[:, names.index("cheek_l")] = np.nan
    positions[1] = world.take.positions[1]
    positions[1, [names.index(name) for name in rigid[:2]]] = np.nan
    positions[:, names.index("lid_r"), 1] += np.linspace(0.0, 0.02, len(positions))
    bound = [name for name in names if name not in rigid]
    setup = replace(
        world.setup(neutral=(0, 3), head="markers", head_markers=rigid),
        binding=Binding(tuple(bound), np.array([world.points[name] for name in bound]), "head"),
        clean=CleanOptions(blinks=False, swaps=False, spikes=False, gaps=False),
    )
    result = usdface.retarget(Shot(world.rig, replace(world.take, positions=positions), setup))
    assert result.solution is not None and "cheek_l" in result.solution.markers
    astray = shot_measures(result, {})["MARKER_ASTRAY"]
    assert astray.where == ("lid_r",) and astray.value > 5.0
