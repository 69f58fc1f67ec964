import tracemalloc
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from scipy.interpolate import RBFInterpolator

from usdface.errors import SolveError
from usdface.options import Kernel, MapOptions
from usdface.retarget import rbf
from usdface.retarget.rbf import fit_map, fit_paper_map, kernel_slopes, kernel_values, spacing

RNG = np.random.default_rng(2)
KERNELS = get_args(Kernel)
SOURCE = RNG.normal(size=(20, 3))
TARGET = SOURCE * 1.3 + 0.1 * RNG.normal(size=(20, 3))


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_papers_map_interpolates_its_training_pair(kernel: Kernel, dimension: int) -> None:
    source = SOURCE[:, :dimension]
    np.testing.assert_allclose(fit_paper_map(source, TARGET, kernel)(source), TARGET, atol=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
def test_vector_values_equal_each_component_alone(kernel: Kernel) -> None:
    space = fit_paper_map(SOURCE, TARGET, kernel)
    points = RNG.normal(size=(7, 3))
    for axis in range(3):
        alone = np.zeros_like(TARGET)
        alone[:, axis] = TARGET[:, axis]
        np.testing.assert_allclose(
            fit_paper_map(SOURCE, alone, kernel)(points)[:, axis], space(points)[:, axis], atol=1e-9
        )


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_papers_map_does_not_depend_on_the_unit(kernel: Kernel) -> None:
    points = RNG.normal(size=(7, 3))
    metres, millimetres = (
        fit_paper_map(SOURCE, TARGET, kernel),
        fit_paper_map(SOURCE * 1000, TARGET * 1000, kernel),
    )
    np.testing.assert_allclose(millimetres(points * 1000) / 1000, metres(points), atol=1e-8)


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_neutral_map_agrees_with_scipy(kernel: Kernel) -> None:
    """The radial field over the similarity is scipy's smoothed interpolant of degree 0."""
    options = MapOptions(kernel=kernel, radius=2.0, smoothing=0.3)
    space = fit_map(SOURCE, TARGET, options)
    rest = TARGET - (SOURCE @ space.linear + space.offset)
    names = {"inverse_quadratic": "inverse_quadratic", "gaussian": "gaussian"}
    judge = RBFInterpolator(
        SOURCE,
        rest,
        kernel=names.get(kernel, kernel),
        epsilon=1.0 / space.radius,
        smoothing=0.3,
        degree=0,
    )
    points = RNG.normal(size=(50, 3))
    ours = space(points) - (points @ space.linear + space.offset)
    np.testing.assert_allclose(ours, judge(points), atol=1e-9)


def test_equal_faces_are_mapped_exactly() -> None:
    turned = SOURCE[:, [1, 2, 0]] * 0.02 + [1.0, 2.0, 3.0]
    points = RNG.normal(size=(5, 3))
    mapped = fit_map(SOURCE, turned, MapOptions())(points)
    np.testing.assert_allclose(mapped, points[:, [1, 2, 0]] * 0.02 + [1, 2, 3], atol=1e-12)


@pytest.mark.parametrize("form", ["neutral_relative", "paper"])
def test_neutral_moves_nothing(form: str) -> None:
    space = fit_map(SOURCE, TARGET, MapOptions(form=form))  # type: ignore[arg-type]
    np.testing.assert_allclose(space.displacements(SOURCE), 0.0, atol=1e-12)


def test_an_image_gets_its_depth_from_the_character() -> None:
    image = TARGET[:, :2] * 700 + [320, 240]
    space = fit_map(image, TARGET, MapOptions(smoothing=0.0))
    np.testing.assert_allclose(space(image), TARGET, atol=1e-9)


def test_an_occluded_marker_stays_occluded() -> None:
    points = SOURCE.copy()
    points[3] = np.nan
    mapped = fit_map(SOURCE, TARGET, MapOptions())(points)
    assert np.isnan(mapped[3]).all() and np.isfinite(np.delete(mapped, 3, axis=0)).all()


def test_coinciding_markers_are_named_as_the_cause() -> None:
    twice = SOURCE.copy()
    twice[1] = twice[0]
    with pytest.raises(SolveError, match="same neutral place"):
        fit_paper_map(twice, TARGET)
    assert np.isfinite(fit_map(twice, TARGET, MapOptions()).coefficients).all()


def test_kernels_are_the_papers() -> None:
    """[RBF] equation 6 and the three others it names, with e = 1 / r."""
    d, r = np.array([0.0, 1.0, 2.5]), 2.0
    np.testing.assert_allclose(kernel_values("multiquadric", d, r), np.sqrt(d**2 + r**2))
    np.testing.assert_allclose(kernel_values("gaussian", d, r), np.exp(-((d / r) ** 2)))
    np.testing.assert_allclose(kernel_values("inverse_quadratic", d, r), 1 / (1 + (d / r) ** 2))
    np.testing.assert_allclose(
        kernel_values("inverse_multiquadric", d, r), 1 / np.sqrt(1 + (d / r) ** 2)
    )


@pytest.mark.parametrize("kernel", KERNELS)
def test_slopes_of_kernels_are_their_derivatives_over_distance(kernel: Kernel) -> None:
    """Beside central differences; at 0 the limit."""
    distances, radius, small = np.array([0.3, 1.0, 2.5, 9.0]), 1.7, 1e-5
    ahead, behind = (kernel_values(kernel, distances + h, radius) for h in (small, -small))
    slopes = kernel_slopes(kernel, distances, radius)
    np.testing.assert_allclose(slopes * distances, (ahead - behind) / (2 * small), rtol=1e-7)
    at_zero, near = (kernel_slopes(kernel, np.array([d]), radius) for d in (0.0, 1e-6))
    np.testing.assert_allclose(at_zero, near, rtol=1e-9)


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("dimension", [2, 3])
def test_the_derivative_is_that_of_the_map(kernel: Kernel, dimension: int) -> None:
    source, small = SOURCE[:, :dimension], 1e-5
    space = fit_map(source, TARGET, MapOptions(kernel=kernel, smoothing=0.01))
    assert space.derivative.shape == (len(source), dimension, 3)
    for axis in range(dimension):
        step = small * np.eye(dimension)[axis]
        numeric = (space(source + step) - space(source - step)) / (2 * small)
        np.testing.assert_allclose(space.derivative[:, axis], numeric, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("kernel", KERNELS)
def test_displacements_are_carried_by_the_derivative_where_markers_rest(kernel: Kernel) -> None:
    """Linear, so that a shape of half the size stays half; for small ones the mapped difference."""
    space = fit_map(SOURCE, TARGET, MapOptions(kernel=kernel, smoothing=0.01))
    moved = 0.3 * RNG.normal(size=(5, *SOURCE.shape))
    carried = space.displacements(SOURCE + moved)
    expected = np.einsum("fmi,mij->fmj", moved, space.derivative)
    np.testing.assert_allclose(carried, expected, atol=1e-12)
    np.testing.assert_allclose(space.displacements(SOURCE + 0.5 * moved), carried / 2, atol=1e-12)
    small = space.displacements(SOURCE + 1e-5 * moved)
    np.testing.assert_allclose(small, space(SOURCE + 1e-5 * moved) - space(SOURCE), atol=1e-8)
    assert np.abs(carried - (space(SOURCE + moved) - space(SOURCE))).max() > 1e-3


def test_the_papers_map_carries_mapped_places() -> None:
    space = fit_paper_map(SOURCE, TARGET)
    moved = SOURCE + 0.3 * RNG.normal(size=SOURCE.shape)
    np.testing.assert_array_equal(space.displacements(moved), space(moved) - space(SOURCE))


def test_where_the_centres_start_is_added() -> None:
    space = fit_map(SOURCE, TARGET, MapOptions())
    start = RNG.normal(size=TARGET.shape)
    moved = SOURCE + 0.1
    np.testing.assert_array_equal(
        replace(space, start=start).displacements(moved), space.displacements(moved) + start
    )


def test_an_occluded_marker_has_no_displacement_and_hides_no_other() -> None:
    points = np.repeat(SOURCE[None], 3, axis=0) + 0.1
    points[1, 3] = np.nan
    moved = fit_map(SOURCE, TARGET, MapOptions()).displacements(points)
    assert np.isnan(moved[1, 3]).all() and np.isnan(moved).sum() == 3


def test_maps_do_not_depend_on_how_many_distances_are_held(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = fit_map(SOURCE, TARGET, MapOptions(smoothing=0.01))
    apart = spacing(SOURCE), whole.derivative
    monkeypatch.setattr(rbf, "_CHUNK_ELEMENTS", 3 * len(SOURCE))
    parts = fit_map(SOURCE, TARGET, MapOptions(smoothing=0.01))
    np.testing.assert_array_equal(parts.coefficients, whole.coefficients)
    assert spacing(SOURCE) == apart[0]
    np.testing.assert_allclose(parts.derivative, apart[1], rtol=1e-9)


def test_many_markers_need_no_distances_of_all_pairs_but_in_the_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(rbf, "_CHUNK_ELEMENTS", 20_000)
    source = RNG.normal(size=(600, 3))
    target = source * 1.3 + 0.1 * RNG.normal(size=source.shape)
    system = len(source) ** 2 * 8
    tracemalloc.start()
    try:
        space = fit_map(source, target, MapOptions())
        _, fitting = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        held = tracemalloc.get_traced_memory()[0]
        assert space.derivative.shape == (600, 3, 3)
        derived = tracemalloc.get_traced_memory()[1] - held
    finally:
        tracemalloc.stop()
    assert fitting < 2.6 * system  # with the copy that is factorised
    assert derived < 1.0 * system
