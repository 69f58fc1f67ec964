from typing import get_args

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from usdface.options import Kernel, MapOptions
from usdface.retarget.map_choice import _rest_without, choose_map, left_out_errors
from usdface.retarget.rbf import fit_map, spacing

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
