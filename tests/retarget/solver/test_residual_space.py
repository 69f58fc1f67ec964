import tracemalloc

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt

from usdface.arrays import BoolArray, FloatArray
from usdface.geometry.rigid_modes import motion_basis
from usdface.retarget.solver import residual_space as module
from usdface.retarget.solver.noise import independent_lags, white_noise
from usdface.retarget.solver.residual_space import ResidualSpace


@pytest.fixture(autouse=True, params=["in a basis", "of many coordinates"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test, also as for so many coordinates that no basis is made of them."""
    if request.param == "of many coordinates":
        monkeypatch.setattr(module, "_BASIS", 0)


def all_seen(observed: FloatArray) -> BoolArray:
    return np.ones(observed.shape, dtype=bool)


def a_take_with_gaps() -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return explained directions, noisy displacements by them, and where these are seen.

    A fifth is occluded, and in nearly every frame something.
    """
    rng = np.random.default_rng(13)
    explained = rng.normal(size=(5, 40))
    motion = np.sin(np.arange(600)[:, None] * rng.uniform(0.02, 0.1, 5)) @ explained
    seen = np.ones((600, 40), dtype=bool)
    for column in range(40):
        for start in rng.integers(0, 560, 4):
            seen[start : start + 30, column] = False
    return explained, motion + 1e-3 * rng.normal(size=(600, 40)), seen


def a_slow_take(rate: float) -> tuple[FloatArray, ResidualSpace, FloatArray]:
    """Return times of 20 s, the unexplained part, and displacements with a slow misfit."""
    rng = np.random.default_rng(11)
    times = np.arange(0.0, 20.0, 1.0 / rate)
    explained = rng.normal(size=(5, 40))
    motion = np.sin(times[:, None] * rng.uniform(1, 5, 5)) @ explained
    misfit = 1e-2 * np.sin(times[:, None] * 2.0) * rng.normal(size=40)
    observed = motion + misfit
    return times, ResidualSpace.of(explained, all_seen(observed), independent_lags(times)), observed


def test_the_noise_is_found_under_motion_and_misfit() -> None:
    """Known noise, a moving face, and a slow misfit ten times as large as the noise."""
    rng = np.random.default_rng(11)
    times = np.arange(600) / 60
    explained = rng.normal(size=(5, 40))
    motion = np.sin(times[:, None] * rng.uniform(1, 5, 5)) @ explained
    misfit = 1e-2 * np.sin(times[:, None] * 2.0) * rng.normal(size=40)
    observed = motion + misfit + 1e-3 * rng.normal(size=(600, 40))
    part = ResidualSpace.of(explained, all_seen(observed))
    assert part.noise(observed) == pytest.approx(1e-3, rel=0.05)
    observed[::50] += 1.0  # spikes
    assert part.noise(observed) == pytest.approx(1e-3, rel=0.15)


@pytest.mark.parametrize("hertz", [6.0, 8.0, 12.0, 20.0])
def test_the_noise_of_a_filtered_take_is_what_the_filter_leaves(hertz: float) -> None:
    """Neighbouring frames have the same error, and would show hardly any."""
    _, part, observed = a_slow_take(60.0)
    noise = 1e-3 * np.random.default_rng(3).normal(size=observed.shape)
    filtered = filtfilt(*butter(2, hertz / 30.0), noise, axis=0)
    assert part.noise(observed + filtered) == pytest.approx(filtered.std(), rel=0.1)
    assert white_noise(filtered) < 0.75 * filtered.std()


@pytest.mark.parametrize("factor", [2, 4])
def test_the_noise_of_an_interpolated_take_is_that_of_its_own_frames(factor: int) -> None:
    times, part, observed = a_slow_take(30.0 * factor)
    own = 1e-3 * np.random.default_rng(3).normal(size=observed[::factor].shape)
    between = CubicSpline(times[::factor], own)(times)
    assert part.noise(observed + between) == pytest.approx(between.std(), rel=0.1)
    assert white_noise(between) < 0.5 * between.std()


@pytest.mark.parametrize(("rate", "frames"), [(24.0, 8), (24.0, 12), (60.0, 20), (120.0, 40)])
@pytest.mark.parametrize("unexplained", [1, 2, 6])
def test_the_noise_of_a_short_take_is_no_larger(rate: float, frames: int, unexplained: int) -> None:
    """The stillest of a few frames moves more than the stillest twentieth of many."""
    rng = np.random.default_rng(7)
    lags = independent_lags(np.arange(frames) / rate)
    found = []
    for _ in range(40):
        observed = 1e-3 * rng.normal(size=(frames, 12))
        explained = rng.normal(size=(12 - unexplained, 12))
        found.append(ResidualSpace.of(explained, all_seen(observed), lags).noise(observed))
    assert np.mean(found) == pytest.approx(1e-3, rel=0.5)


def test_noise_that_gaps_leave_as_white_hides_no_misfit() -> None:
    rng = np.random.default_rng(7)
    observed = 1e-3 * rng.normal(size=(60, 6))
    seen = all_seen(observed)
    seen[np.arange(60), np.arange(60) % 4] = False  # no coordinate of four is seen for four frames
    part = ResidualSpace.of(np.eye(6)[4:], seen, independent_lags(np.arange(60) / 60))
    assert part.noise(observed) == pytest.approx(1e-3, rel=0.3)
    assert part.least_misfit(observed, part.noise(observed)) == 0.0


@pytest.mark.parametrize("gaps", [False, True])
def test_the_noise_does_not_depend_on_the_order_of_shapes_and_coordinates(gaps: bool) -> None:
    explained, observed, seen = a_take_with_gaps()
    observed += 0.01 * np.sin(np.arange(600)[:, None] * 0.3) ** 3  # a misfit
    seen = seen if gaps else all_seen(observed)
    noise = ResidualSpace.of(explained, seen).noise(observed)
    assert ResidualSpace.of(explained[::-1], seen).noise(observed) == pytest.approx(noise, rel=1e-9)
    others = np.random.default_rng(5).permutation(40)
    part = ResidualSpace.of(explained[:, others], seen[:, others])
    assert part.noise(observed[:, others]) == pytest.approx(noise, rel=1e-9)


def test_noise_cannot_be_told_from_too_little() -> None:
    short, explained = np.zeros((3, 4)), np.zeros((9, 2))
    assert ResidualSpace.of(np.zeros((1, 4)), all_seen(short)).noise(short) == 0.0
    assert ResidualSpace.of(np.eye(2), all_seen(explained)).noise(explained) == 0.0
    assert white_noise(np.full((9, 2), np.nan)) == 0.0


def test_the_misfit_is_found_under_motion_rest_and_noise() -> None:
    """Rest has no misfit, an expression a lot, and a marker swapped now and then is none."""
    rng = np.random.default_rng(12)
    explained, rest = np.eye(60)[:5], np.eye(60)[5:]
    motion = rng.normal(size=(1000, 5)) @ explained
    direction = rng.normal(size=55)
    misfit = (direction / np.sqrt(np.mean(direction**2))) @ rest
    size = np.where(np.arange(1000) < 600, 0.0, 1e-2)[:, None]
    observed = motion + size * misfit
    part = ResidualSpace.of(explained, all_seen(observed))
    assert part.misfit(observed, 0.0) == pytest.approx(1e-2)
    noise = 1e-3 * rng.normal(size=(1000, 60))
    assert part.misfit(motion + noise, 1e-3) < 4e-4
    assert part.misfit(observed + noise, 1e-3) == pytest.approx(1e-2, rel=0.05)
    observed[::50] += misfit
    assert part.misfit(observed, 0.0) == pytest.approx(1e-2)


def test_a_misfit_below_its_standard_error_is_not_taken_for_none() -> None:
    """The least is that which as much pure noise shows by chance, and falls with the frames."""
    rng = np.random.default_rng(13)
    explained = np.eye(60)[:5]
    least = []
    for frames in (200, 3200):
        noise = 1e-3 * rng.normal(size=(frames, 60))
        part = ResidualSpace.of(explained, all_seen(noise))
        least.append(part.misfit(noise, 1.1e-3))  # noise explains more than all of it
        assert part.misfit(0.0 * noise, 0.0) == 0.0
    assert 0.0 < least[1] < least[0] < 1.1e-4
    assert least[0] / least[1] == pytest.approx(2.0)  # the root of the standard error


def test_misfit_cannot_be_told_from_too_little() -> None:
    values = np.ones((9, 4))
    assert ResidualSpace.of(np.eye(4), all_seen(values)).misfit(values, 0.0) == 0.0
    hidden = np.zeros((9, 4), dtype=bool)
    assert ResidualSpace.of(np.eye(4)[:1], hidden).misfit(values, 0.0) == 0.0


def test_occluded_markers_are_no_evidence_of_noise_and_misfit() -> None:
    """Whatever fills the gaps: noise is the seen markers', and there is no misfit."""
    explained, observed, seen = a_take_with_gaps()
    part = ResidualSpace.of(explained, seen)
    for filling in (0.0, 5.0):
        filled = np.where(seen, observed, filling)
        assert part.noise(filled) == pytest.approx(1e-3, rel=0.02)
        assert part.misfit(filled, part.noise(filled)) < 2e-4


def test_a_frame_is_judged_by_the_best_fit_to_its_seen_coordinates() -> None:
    explained, observed, seen = a_take_with_gaps()
    part = ResidualSpace.of(explained, seen)
    squares, counts = part.squares(np.where(seen, observed, -3.0))
    for place in (0, 100, -1):
        frame = part.frames[place]
        directions, values = explained[:, seen[frame]].T, observed[frame, seen[frame]]
        left = values - directions @ np.linalg.lstsq(directions, values, rcond=None)[0]
        assert counts[place] == len(values) - 5
        assert squares[place] * counts[place] == pytest.approx(left @ left)


def test_rounds_find_what_is_occluded_once() -> None:
    explained, observed, seen = a_take_with_gaps()
    part = ResidualSpace.of(explained, seen, (1, 6))
    noise = part.noise(observed)
    windows = dict(part.windows)
    assert set(windows) == {1, 6}
    assert part.noise(2.0 * observed) == pytest.approx(2.0 * noise)
    part.least_misfit(observed, noise)
    assert all(part.windows[lag] is known for lag, known in windows.items())


def test_blend_shapes_that_differ_by_the_rounding_of_a_file_are_one() -> None:
    """10 nm, as float32 rounds: neither the noise nor the misfit of a take hangs on them."""
    rng = np.random.default_rng(3)
    shapes = 0.002 * rng.standard_normal((6, 60))
    weights = rng.uniform(size=(400, 6))
    observed = weights @ shapes + 0.0002 * rng.standard_normal((400, 60))
    observed += 0.0004 * weights[:, :1] * rng.standard_normal(60)
    seen = np.ones(observed.shape, dtype=bool)
    found = []
    for seed in range(4):
        rounded = 1e-8 * np.random.default_rng(seed).standard_normal((2, 6, 60))
        rest = ResidualSpace.of(np.vstack([shapes + rounded[0], shapes + rounded[1]]), seen)
        noise = rest.noise(observed)
        found.append((rest.dimension, noise, rest.misfit(observed, noise)))
    assert {size for size, _, _ in found} == {54}
    np.testing.assert_allclose([(a, b) for _, a, b in found], [found[0][1:]] * 4, rtol=0.05)


def test_occluded_coordinates_that_are_explained_anyway_take_no_evidence_away() -> None:
    explained, observed, seen = a_take_with_gaps()
    explained = np.concatenate([explained, np.eye(40)[:3]])
    seen[:, :3] = True
    whole = ResidualSpace.of(explained, seen)
    seen[100:300, :3] = False
    part = ResidualSpace.of(explained, seen)
    np.testing.assert_array_equal(part.frames, whole.frames)
    for found, expected in zip(part.squares(observed), whole.squares(observed), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_noise_of_few_markers_is_that_of_their_displacements() -> None:
    """Weights and pose explain all that eight markers can do; what trembles is noise."""
    rng = np.random.default_rng(14)
    motion = 5e-3 * np.sin(np.arange(600)[:, None] * rng.uniform(0.02, 0.1, 24))
    observed = motion + 3e-4 * rng.normal(size=(600, 24))
    part = ResidualSpace.of(rng.normal(size=(53, 24)), all_seen(observed))
    assert part.noise(observed) == pytest.approx(3e-4, rel=0.1)


def test_noise_is_found_where_gaps_leave_nothing_unexplained() -> None:
    """One coordinate more than unknowns, and in each frame one that is occluded."""
    rng = np.random.default_rng(15)
    observed = 3e-4 * rng.normal(size=(600, 25))
    seen = np.ones((600, 25), dtype=bool)
    for frame in range(600):
        seen[frame, frame // 30] = False
    observed[~seen] = 5.0
    part = ResidualSpace.of(rng.normal(size=(24, 25)), seen)
    assert part.noise(observed) == pytest.approx(3e-4, rel=0.1)


def test_noise_is_that_of_the_face_in_any_unit() -> None:
    """A shape that moves by 12 micrometres on a human face is one in any unit, beside the head."""
    rng = np.random.default_rng(16)
    rest = 0.06 * rng.normal(size=(12, 3))
    shapes = 0.003 * rng.normal(size=(10, 36))
    shapes[0] *= 12e-6 / np.linalg.norm(shapes[0])
    observed = rng.uniform(0, 1, (200, 10)) @ shapes + 3e-4 * rng.normal(size=(200, 36))
    rigid, seen = motion_basis(rest, 3), all_seen(observed)
    parts = [
        ResidualSpace.beside_head(k * shapes, rigid, k * rest, seen, (1,))
        for k in (0.01, 1.0, 100.0)
    ]
    assert [part.dimension for part in parts] == [36 - 6 - 10] * 3
    found = [
        part.noise(k * observed) / k for part, k in zip(parts, (0.01, 1.0, 100.0), strict=True)
    ]
    np.testing.assert_allclose(found, found[1], rtol=1e-9)


@pytest.mark.parametrize("gaps", [False, True])
def test_noise_and_misfit_are_the_same_without_a_basis(
    monkeypatch: pytest.MonkeyPatch, gaps: bool
) -> None:
    explained, observed, seen = a_take_with_gaps()
    seen = seen if gaps else all_seen(observed)
    found = []
    for most in (0, 3000):
        monkeypatch.setattr(module, "_BASIS", most)
        part = ResidualSpace.of(explained, seen, (1, 6))
        assert (part.basis is None) == (most == 0)
        noise = part.noise(observed)
        squares, count = part.squares(observed)
        found.append((noise, part.misfit(observed, noise), *squares, *count))
        assert part.dimension == 35
    np.testing.assert_allclose(*found, rtol=1e-9)


def test_very_many_coordinates_need_no_matrix_of_all_pairs() -> None:
    """As where the points of a scan are markers: 29 GB for 20,000 of them."""
    rng = np.random.default_rng(5)
    explained, count = rng.normal(size=(6, 3600)), 3600
    observed = rng.normal(size=(30, 6)) @ explained + 1e-3 * rng.normal(size=(30, count))
    tracemalloc.start()
    try:
        part = ResidualSpace.of(explained, all_seen(observed))
        noise = part.noise(observed)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert noise == pytest.approx(1e-3, rel=0.05)
    assert peak < 0.2 * count**2 * 8
