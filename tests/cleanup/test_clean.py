"""On real optical takes: artificial gaps, swaps and spikes, seeds fixed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh, landmarks
from scipy.spatial.transform import Rotation

from usdface.arrays import FloatArray
from usdface.cleanup.clean import Cleaned, clean_take
from usdface.face.curve_mapping import rename_weights
from usdface.io.takes.files import read_take
from usdface.options import CleanOptions
from usdface.takes import MarkerTake, WeightsTake


def clean(take: MarkerTake, moving: bool = True, **steps: bool) -> Cleaned:
    return clean_take(take, take.names, CleanOptions(**steps), moving=moving)[0]


def entries(cleaned: Cleaned, kind: str) -> np.ndarray:
    """Return where repairs of a kind are: (F, M)."""
    where = np.zeros(cleaned.measured.shape, dtype=bool)
    for repair in cleaned.repairs:
        if repair.kind == kind:
            column = cleaned.take.names.index(repair.marker)
            where[repair.first : repair.last + 1, column] = True
    return where


@pytest.fixture(scope="module", params=["Jaw", "Eyebrows"])
def real(request: pytest.FixtureRequest, shared_data: Path) -> MarkerTake:
    take, _ = read_take(shared_data / "animface" / f"{request.param}.c3d")
    assert isinstance(take, MarkerTake)
    return take


def test_a_clean_take_is_not_touched(real: MarkerTake) -> None:
    assert clean(real).repairs == ()
    assert clean(real).take is real


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 3e-4])
def test_swaps_and_spikes_are_found_and_nothing_else_is_touched(
    real: MarkerTake, noise: float
) -> None:
    """Measured: precision and recall 1."""
    rng = np.random.default_rng(31)
    positions = real.positions + noise * rng.normal(size=real.positions.shape)
    broken, (frames, count) = positions.copy(), positions.shape[:2]
    swaps, spikes, near = np.zeros((3, frames, count), dtype=bool)
    for kind, most, times in (("swap", 150, 15), ("spike", 6, 40)):
        for _ in range(times):
            length = rng.integers(1, most)
            first = rng.integers(5, frames - length - 5)
            who = rng.choice(count, 2 if kind == "swap" else 1, replace=False)
            rows = slice(first, first + length)
            around = slice(first - 2, first + length + 2)
            if near[around, who].any():
                continue
            near[around, who] = True
            if kind == "swap":
                broken[rows, who] = broken[rows, who[::-1]]
                swaps[rows, who] = True
            else:
                away = rng.normal(size=3)
                broken[rows, who] += away / np.linalg.norm(away) * rng.uniform(0.005, 0.03)
                spikes[rows, who] = True
    cleaned = clean(replace(real, positions=broken))
    for kind, truth in (("swap", swaps), ("spike", spikes)):
        found = entries(cleaned, kind)
        hits = (found & truth).sum()
        print(f"{kind}: precision {hits / found.sum():.3f}, recall {hits / truth.sum():.3f}")
        assert hits >= 0.95 * found.sum()
        assert hits >= 0.95 * truth.sum()
    good = ~spikes & ~entries(cleaned, "fill")
    np.testing.assert_allclose(cleaned.take.positions[good], positions[good], atol=1e-12)


@pytest.mark.parametrize(("frames", "bound"), [(6, 0.14), (60, 0.60), (240, 1.2)])
def test_gaps_come_back(shared_data: Path, frames: int, bound: float) -> None:
    """Mean error [mm] of 12 gaps of 0.1, 1 and 4 s, two at a time; measured: 0.04, 0.5, 1.0."""
    rng, errors = np.random.default_rng(4), []
    for name in ("Jaw", "Eyebrows"):
        take, _ = read_take(shared_data / "animface" / f"{name}.c3d")
        assert isinstance(take, MarkerTake)
        for pair in rng.permutation(41)[:6].reshape(-1, 2):
            gap = np.zeros(take.visible.shape, dtype=bool)
            for marker in pair:
                first = rng.integers(5, len(gap) - frames - 5)
                gap[first : first + frames, marker] = True
            lost = np.where(gap[..., None], np.nan, take.positions)
            cleaned = clean(replace(take, positions=lost))
            np.testing.assert_array_equal(entries(cleaned, "fill"), gap)
            np.testing.assert_array_equal(cleaned.measured, ~gap)
            apart = np.linalg.norm(cleaned.take.positions - take.positions, axis=2)
            errors.append(1000.0 * apart[gap].mean())
    print(f"{frames / 60:g} s: {np.mean(errors):.3f} mm")
    assert np.mean(errors) <= bound


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-6, 3e-4, 1e-3])
def test_a_known_answer_raises_no_false_alarm(shared_data: Path, noise: float) -> None:
    """Real weight curves at 30 Hz on the ICT face, 68 landmarks, with its own jumps and blinks."""
    mesh, points = ict_mesh(shared_data), landmarks(shared_data)
    recorded, _ = read_take(shared_data / "livelinkface" / "alex_rom_3.csv")
    assert isinstance(recorded, WeightsTake)
    weights = rename_weights(recorded, mesh.shape_names)[0].weights
    still = mesh.points[points] + np.einsum("fs,smd->fmd", weights, mesh.offsets_at(points))
    noisy = still + noise * np.random.default_rng(9).normal(size=still.shape)
    take = MarkerTake(tuple(f"l{k}" for k in range(68)), np.arange(len(still)) / 30, noisy, 30.0)
    assert clean(take, moving=False).repairs == ()


PLACES = 0.05 * np.random.default_rng(0).normal(size=(20, 3))


def made(frames: int = 120, markers: int = 20) -> FloatArray:
    """Return markers that move with two modes and a little noise: (F, M, 3)."""
    rng = np.random.default_rng(1)
    time = np.arange(frames)[:, None, None] / 60
    modes = 0.004 * rng.normal(size=(2, markers, 3))
    moved = PLACES[:markers] + np.sin(3 * time) * modes[0] + np.cos(5 * time) * modes[1]
    return np.asarray(moved + 1e-4 * rng.normal(size=moved.shape))


def take_of(positions: FloatArray) -> MarkerTake:
    frames, count = positions.shape[:2]
    return MarkerTake(tuple(f"m{k}" for k in range(count)), np.arange(frames) / 60, positions, 60.0)


def lost(where: Callable[[np.ndarray], None]) -> FloatArray:
    positions = made()
    where(positions)
    return positions


def test_each_step_can_be_left_out() -> None:
    positions = made()
    positions[30:40, [0, 1]] = positions[30:40, [1, 0]]
    positions[80:90, 7] = np.nan
    take = take_of(positions)
    assert {r.kind for r in clean(take).repairs} == {"swap", "fill"}
    assert "swap" not in {r.kind for r in clean(take, swaps=False).repairs}
    assert "fill" not in {r.kind for r in clean(take, gaps=False).repairs}
    untouched = clean(take, swaps=False, spikes=False, gaps=False)
    assert untouched.take is take and untouched.repairs == ()


def test_each_of_two_swaps_is_judged_by_itself() -> None:
    """The first is not seen to end, as label 1 is lost: it was believed during the second."""
    positions, truth = made(), np.zeros((120, 20), dtype=bool)
    for labels, frames in (([0, 1], slice(80, 90)), ([5, 6], slice(100, 110))):
        positions[frames, labels] = positions[frames, labels[::-1]]
        truth[frames, labels] = True
    positions[90:, 1] = np.nan
    np.testing.assert_array_equal(entries(clean(take_of(positions)), "swap"), truth)


def test_a_swap_that_never_ends_is_of_the_frames_after_the_neutral() -> None:
    positions, truth = made(), np.zeros((120, 20), dtype=bool)
    positions[40:, [0, 1]] = positions[40:, [1, 0]]
    truth[40:, [0, 1]] = True
    take = take_of(positions)
    cleaned, _ = clean_take(take, take.names, CleanOptions(), neutral=(0, 9))
    np.testing.assert_array_equal(entries(cleaned, "swap"), truth)


def test_what_is_not_of_the_face_is_left_alone() -> None:
    positions = made()
    positions[60:62, 5] += 0.02
    take = take_of(positions)
    cleaned, _ = clean_take(take, set(take.names) - {"m5"}, CleanOptions())
    assert cleaned.repairs == ()


def test_nothing_is_invented() -> None:
    """A marker that is never or once seen, and a stretch in which the face is lost, stay so."""
    positions = made()
    positions[:, 3] = np.nan
    positions[1:, 4] = np.nan
    positions[50:80] = np.nan
    cleaned = clean(take_of(positions))
    np.testing.assert_array_equal(cleaned.take.positions, positions)


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (9999999.0,) * 3, (0.3, 1.5, 0.2)])
def test_places_far_from_the_face_are_spikes_of_their_markers_alone(place) -> None:
    """What programs write for lost markers, of two markers at once, and a reflection."""
    positions = made() + [0.1, 1.5, 0.3] * np.sin(np.linspace(1, 2, 120))[:, None, None]
    broken = positions.copy()
    broken[40:65, [3, 8]] = place
    cleaned = clean(take_of(broken))
    spikes = entries(cleaned, "spike")
    assert spikes[40:65, [3, 8]].all() and spikes.sum() == 50
    hidden = positions.copy()
    hidden[40:65, [3, 8]] = np.nan
    filled = clean(take_of(hidden)).take.positions
    np.testing.assert_allclose(cleaned.take.positions, filled, atol=1e-9)
    kept = clean(take_of(broken), spikes=False).take.positions[40:65, [3, 8]]
    np.testing.assert_array_equal(kept, broken[40:65, [3, 8]])


def test_a_marker_that_is_mostly_elsewhere_is_left_there() -> None:
    positions = made()
    positions[:80, 5] = (0, 2, 0)
    assert not entries(clean(take_of(positions)), "spike")[:80].any()


def test_a_moment_without_the_face_is_bridged() -> None:
    positions = made()
    positions[50:54] = np.nan
    cleaned = clean(take_of(positions))
    assert cleaned.take.visible.all()
    assert np.abs(cleaned.take.positions - made()).max() < 2e-3


def test_a_marker_left_alone_on_a_head_that_moves_on_is_no_spike() -> None:
    positions = made(frames=150)
    turn = 0.8 * np.sin(np.linspace(0, 2 * np.pi, 150))[:, None] * [0.0, 1.0, 0.0]
    positions = np.einsum("fij,fmj->fmi", Rotation.from_rotvec(turn).as_matrix(), positions)
    for marker in (2, 4, 9):
        lonely = positions.copy()
        lonely[70:140, np.arange(positions.shape[1]) != marker] = np.nan
        assert not entries(clean(take_of(lonely)), "spike").any()


@pytest.mark.parametrize(
    "positions",
    [
        pytest.param(made(frames=1), id="one frame"),
        pytest.param(made(markers=4), id="four markers"),
        pytest.param(np.zeros((100, 20, 3)), id="one place"),
        pytest.param(made() * 1e200, id="huge"),
        pytest.param(made() * 1e-200, id="tiny"),
        pytest.param(lost(lambda p: p.__setitem__(slice(None), np.nan)), id="nothing seen"),
    ],
)
def test_what_cannot_be_judged_is_left_as_it_is(positions: FloatArray) -> None:
    take = take_of(positions)
    cleaned, findings = clean_take(take, take.names, CleanOptions())
    assert cleaned.take is take
    assert [f.code for f in findings] == ["CLEANUP_SKIPPED"]


RANDOM = np.random.default_rng(5).random((120, 20, 1))


@pytest.mark.parametrize(
    "positions",
    [
        pytest.param(np.tile(PLACES, (100, 1, 1)), id="constant"),
        pytest.param(made() * [1.0, 0.0, 0.0], id="collinear"),
        pytest.param(made()[..., :2] * 4000.0, id="image"),
        pytest.param(made() + 1e9, id="far away"),
        pytest.param(made(frames=16), id="short"),
        pytest.param(
            np.where(RANDOM < 0.3, np.nan, np.tile(PLACES, (120, 1, 1))), id="constant, gaps"
        ),
        pytest.param(np.where(RANDOM < 0.5, np.nan, made()), id="half lost"),
        pytest.param(np.where(RANDOM < 0.2, 1.0, made()), id="one in five wrong"),
        pytest.param(np.random.default_rng(6).normal(size=(100, 20, 3)), id="white"),
    ],
)
@pytest.mark.parametrize("moving", [True, False])
def test_poor_takes_stay_finite(positions: FloatArray, moving: bool) -> None:
    take = take_of(positions)
    cleaned = clean(take, moving).take
    assert np.nanmax(np.abs(cleaned.positions)) <= 2.0 * np.nanmax(np.abs(positions))
