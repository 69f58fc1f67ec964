from typing import get_args

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.options import Kernel, MapOptions
from usdface.retarget.map_choice import _rest_without, choose_map, left_out_errors
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.rbf import SpaceMap, fit_map, spacing

RNG = np.random.default_rng(3)
SOURCE = RNG.normal(size=(14, 3))
BUMP = np.exp(-((SOURCE - 0.3) ** 2).sum(axis=1, keepdims=True) / 2)
TARGET = 1.3 * SOURCE[:, [1, 2, 0]] + BUMP * [0.3, -0.2, 0.1]


@pytest.mark.parametrize("kernel", get_args(Kernel))
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_closed_form_is_what_refits_give(kernel: Kernel, dimension: int) -> None:
    """Similarity and field fitted anew without each marker, the radius held."""
    source, radius, smoothing = SOURCE[:, :dimension], 2.0, 0.3
    rest = _rest_without(source, TARGET)
    errors, _ = left_out_errors(source, rest, kernel, radius, (smoothing,))
    for i in range(len(source)):
        others = np.delete(source, i, axis=0)
        held = radius * spacing(source) / spacing(others)
        options = MapOptions(kernel=kernel, radius=held, smoothing=smoothing)
        space = fit_map(others, np.delete(TARGET, i, axis=0), options)
        np.testing.assert_allclose(errors[i, :, 0], TARGET[i] - space(source[i]), atol=1e-9)


@pytest.mark.parametrize("kernel", get_args(Kernel))
def test_degrees_of_freedom_are_the_trace_of_the_smoother(kernel: Kernel) -> None:
    _, freedom = left_out_errors(SOURCE, _rest_without(SOURCE, TARGET), kernel, 2.0, (0.3,))
    shape = 1 / (2.0 * spacing(SOURCE))
    unit = np.eye(len(SOURCE))
    judge = RBFInterpolator(SOURCE, unit, kernel=kernel, epsilon=shape, smoothing=0.3, degree=0)
    # The constant is one degree of freedom more, which every map has.
    assert freedom[0] == pytest.approx(np.trace(judge(SOURCE)) - 1)


def test_equal_faces_are_carried_exactly_and_without_a_choice() -> None:
    turned = 0.02 * SOURCE[:, [1, 2, 0]] + [1.0, 2.0, 3.0]
    space, choice = choose_map(SOURCE, turned, MapOptions())
    assert choice.name == "similarity" and not space.coefficients.any()
    np.testing.assert_allclose(space(SOURCE), turned, atol=1e-12)


def test_bending_that_explains_nothing_is_left_out() -> None:
    """Markers that sit anywhere near their vertex: no field predicts where."""
    face = RNG.normal(size=(60, 3))
    space, choice = choose_map(face, 2 * face + 0.05 * RNG.normal(size=face.shape), MapOptions())
    assert choice.error <= 1.05 * min(choice.best.values())  # type: ignore[union-attr]
    assert choice.name == "similarity" and not space.coefficients.any()


def test_a_smooth_bend_is_predicted_better_than_by_the_similarity() -> None:
    face = RNG.normal(size=(60, 3))
    bent = face + 0.4 * np.sin(0.7 * face[:, [1, 2, 0]])
    _, choice = choose_map(face, bent, MapOptions())
    assert choice.error < 0.3 * choice.similarity_error
    assert set(choice.best or ()) == set(get_args(Kernel))


def test_the_choice_does_not_depend_on_the_unit() -> None:
    metres, millimetres = (
        choose_map(SOURCE, TARGET, MapOptions())[1],
        choose_map(1000 * SOURCE, 1000 * TARGET, MapOptions())[1],
    )
    assert metres.name == millimetres.name
    assert millimetres.error == pytest.approx(1000 * metres.error)


def test_what_is_fixed_is_not_chosen() -> None:
    options = MapOptions(choice="fixed", radius=1.5, smoothing=0.2)
    space, choice = choose_map(SOURCE, TARGET, options)
    assert choice.name == "multiquadric, radius 1.5, smoothing 0.2" and choice.best is None
    np.testing.assert_array_equal(space(SOURCE), fit_map(SOURCE, TARGET, options)(SOURCE))
    paper, choice = choose_map(SOURCE, TARGET, MapOptions(form="paper"))
    np.testing.assert_allclose(paper(SOURCE), TARGET, atol=1e-9)
    assert choice.name == "paper, multiquadric"


def test_coinciding_markers_are_no_obstacle() -> None:
    twice = SOURCE.copy()
    twice[1] = twice[0]
    space, choice = choose_map(twice, TARGET, MapOptions())
    assert np.isfinite(space(twice)).all() and np.isfinite(choice.error)


def bent_world() -> tuple[np.ndarray, np.ndarray]:
    """Return a performer's markers and the character's: a smooth bend, which rest shows well."""
    face = np.random.default_rng(8).normal(size=(40, 3))
    return face, face + 0.4 * np.sin(0.7 * face[:, [1, 2, 0]])


def test_the_motion_decides_where_resting_markers_say_otherwise() -> None:
    face, bent = bent_world()
    at_rest, choice = choose_map(face, bent, MapOptions())
    assert at_rest.coefficients.any() and choice.unexplained == {}
    space, choice = choose_map(
        face, bent, MapOptions(), lambda space: 0.5 if space.coefficients.any() else 0.1
    )
    assert choice.name == "similarity" and not space.coefficients.any()
    assert choice.error == choice.similarity_error > min((choice.best or {}).values())
    assert set(choice.unexplained) >= {"similarity", at_rest_name(face, bent)}
    assert choice.unexplained["similarity"] == 0.1


def at_rest_name(face: np.ndarray, bent: np.ndarray) -> str:
    return choose_map(face, bent, MapOptions())[1].name


def test_motion_may_ask_for_a_bend_that_rest_does_not_show() -> None:
    face = np.random.default_rng(8).normal(size=(40, 3))
    beside = face + 0.05 * np.random.default_rng(9).normal(size=face.shape)
    assert choose_map(face, beside, MapOptions())[1].name == "similarity"
    bent, choice = choose_map(
        face, beside, MapOptions(), lambda space: 0.1 if space.coefficients.any() else 0.5
    )
    assert bent.coefficients.any() and choice.name != "similarity"
    assert choice.unexplained[choice.name] == 0.1


def test_of_maps_that_motion_likes_as_well_rest_chooses() -> None:
    face, bent = bent_world()
    chosen, choice = choose_map(face, bent, MapOptions(), lambda space: 0.3)
    alone, at_rest = choose_map(face, bent, MapOptions())
    assert choice.name == at_rest.name
    np.testing.assert_array_equal(chosen.coefficients, alone.coefficients)


def test_where_motion_has_no_say_rest_chooses() -> None:
    face, bent = bent_world()
    for share in (np.nan, None):
        unknown = None if share is None else lambda space: np.nan
        _, choice = choose_map(face, bent, MapOptions(), unknown)
        assert choice.name == at_rest_name(face, bent) and choice.unexplained == {}


def test_maps_that_are_fixed_equal_or_the_papers_are_not_asked_about() -> None:
    def never(space: SpaceMap) -> float:
        raise AssertionError

    face, bent = bent_world()
    for options in (MapOptions(choice="fixed"), MapOptions(form="paper")):
        assert choose_map(face, bent, options, never)[1].unexplained == {}
    assert choose_map(face, 2 * face, MapOptions(), never)[1].name == "similarity"


def test_the_take_of_a_bent_performer_chooses_the_map_that_carries_it() -> None:
    """Bent away from the character, the performer moves as the character's own skin does."""
    face, bent = bent_world()
    shapes = BlendShapeEvaluator(0.1 * np.random.default_rng(4).normal(size=(5, 120)))
    times = np.arange(50) / 30
    weights = 0.5 + 0.5 * np.sin(times[:, None] * [3.0, 4.0, 5.0, 6.0, 7.0])
    moved = shapes.displacements(weights).reshape(50, 40, 3)
    evidence = MotionEvidence(times, face + moved)

    def share(space: SpaceMap) -> float:
        return evidence.unexplained_share(space, bent, shapes)

    space, choice = choose_map(face, bent, MapOptions(), share)
    assert choice.name == "similarity" and at_rest_name(face, bent) != "similarity"
    assert share(space) == choice.unexplained["similarity"] < 0.2
    assert min(v for k, v in choice.unexplained.items() if k != "similarity") > 1.2 * share(space)


def test_exchanged_sides_are_not_carried_by_a_mirror() -> None:
    """A field can turn a face inside out and predict resting markers well; no face is a mirror."""
    rng = np.random.default_rng(4)
    face = rng.uniform(-0.08, 0.08, size=(40, 3)) * [1.0, 1.0, 0.5]
    space, choice = choose_map(face, face * [-1.0, 1.0, 1.0], MapOptions())
    assert min(choice.best.values()) < 0.5 * choice.similarity_error  # a mirror predicts better
    assert choice.name == "similarity" and not space.coefficients.any()
    assert np.linalg.det(space.derivative).min() > 0
