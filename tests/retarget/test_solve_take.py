import numpy as np
import pytest

from usdface.errors import InputError
from usdface.findings import Finding
from usdface.options import SolveOptions
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solution import Solution
from usdface.retarget.solve_take import solve_take
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

RNG = np.random.default_rng(9)
FRAMES, MARKERS = 50, 12
NAMES = tuple(f"m{i}" for i in range(MARKERS))
SHAPES = ("open", "smile", "frown")
FACE = 0.08 * RNG.normal(size=(MARKERS, 3))
BASIS = 0.01 * RNG.normal(size=(3, MARKERS, 3))
TIMES = np.arange(FRAMES) / 60
RISE = np.clip((TIMES - 0.2) * 2, 0, 1)
TRUTH = np.stack([RISE, 0.5 * RISE, np.zeros(FRAMES)], axis=1)
POSITIONS = FACE + np.einsum("fs,smi->fmi", TRUTH, BASIS)


def run(
    positions: np.ndarray = POSITIONS, names: tuple[str, ...] = NAMES, **settings: object
) -> tuple[Solution, list[Finding]]:
    binding = Binding(NAMES, np.arange(MARKERS))
    setup = RetargetSetup(binding, **{"head": "stabilised", "neutral": (0, 5), **settings})  # type: ignore[arg-type]
    return solve_take(
        MarkerTake(names, TIMES, positions), BoundPoints.linear(FACE, BASIS, SHAPES), setup
    )


def codes(findings: list[Finding]) -> set[str]:
    return {f.code for f in findings}


def test_weights_come_back_by_name() -> None:
    solution, findings = run()
    np.testing.assert_allclose(solution.weights.column("open"), RISE, atol=1e-6)
    np.testing.assert_allclose(solution.feature_points, POSITIONS, atol=1e-9)
    assert solution.residual.max() < 1e-9 and not findings


def test_another_performer_gives_the_same_weights() -> None:
    """A larger face elsewhere, measured from its own neutral frames."""
    solution, _ = run(POSITIONS * 1.7 + [1.0, 2.0, 3.0])
    np.testing.assert_allclose(solution.weights.weights, TRUTH, atol=1e-6)


def test_columns_of_the_take_travel_by_name() -> None:
    order = RNG.permutation(MARKERS)
    shuffled, _ = run(POSITIONS[:, order], tuple(NAMES[i] for i in order))
    np.testing.assert_allclose(shuffled.weights.weights, TRUTH, atol=1e-6)


def test_a_marker_that_is_never_seen_is_left_out_and_said() -> None:
    positions = POSITIONS.copy()
    positions[:, 2] = np.nan
    solution, findings = run(positions)
    assert codes(findings) == {"MARKER_NEVER_SEEN"} and "m2" not in solution.markers
    np.testing.assert_allclose(solution.weights.weights, TRUTH, atol=1e-6)


def test_a_marker_hidden_at_neutral_is_left_out_and_said() -> None:
    positions = POSITIONS.copy()
    positions[:10, 2] = np.nan
    _, findings = run(positions)
    assert codes(findings) == {"MARKER_WITHOUT_NEUTRAL"}


def test_occlusion_is_normal_and_said() -> None:
    positions = POSITIONS.copy()
    positions[20:30, 4] = np.nan
    solution, findings = run(positions)
    assert codes(findings) == {"MARKER_OCCLUDED"} and "10 of 50" in findings[0].message
    np.testing.assert_allclose(solution.weights.weights, TRUTH, atol=1e-4)


def test_markers_on_one_side_only_are_said() -> None:
    names = (*NAMES[:-1], "extra")
    _, findings = run(names=names)
    assert codes(findings) == {"MARKER_UNKNOWN", "MARKER_UNBOUND"}


def test_a_shape_that_moves_no_marker_stays_at_zero_and_is_said() -> None:
    basis = np.concatenate([BASIS, np.zeros((1, MARKERS, 3))])
    setup = RetargetSetup(Binding(NAMES, np.arange(MARKERS)), head="stabilised", neutral=(0, 5))
    solution, findings = solve_take(
        MarkerTake(NAMES, TIMES, POSITIONS),
        BoundPoints.linear(FACE, basis, (*SHAPES, "blink")),
        setup,
    )
    assert codes(findings) == {"SHAPE_UNSEEN"}
    assert not solution.weights.column("blink").any()


def test_nothing_in_common_is_an_error() -> None:
    with pytest.raises(InputError, match="none of the 12 bound markers"):
        run(names=tuple(f"x{i}" for i in range(MARKERS)))


def test_too_few_markers_at_neutral_is_an_error() -> None:
    positions = POSITIONS.copy()
    positions[:6, 3:] = np.nan
    with pytest.raises(InputError, match="at least 4"):
        run(positions)


def test_an_image_has_no_neutral_on_the_rig() -> None:
    with pytest.raises(InputError, match="2D take"):
        run(POSITIONS[..., :2] * 1000, neutral=None)


def test_an_image_is_retargeted_in_its_own_pixels() -> None:
    solution, _ = run(POSITIONS[..., :2] * 4000 + [320, 240])
    assert solution.dimension == 2 and not solution.posed_in_space
    assert np.sqrt(np.mean((solution.weights.weights - TRUTH) ** 2)) < 0.1


def test_head_markers_hold_the_head_still() -> None:
    """Markers that no shape moves carry the head; the others move with the face."""
    basis = BASIS.copy()
    basis[:, :4] = 0.0
    positions = FACE + np.einsum("fs,smi->fmi", TRUTH, basis)
    turned = positions[..., [1, 2, 0]] + np.sin(TIMES)[:, None, None]
    setup = RetargetSetup(
        Binding(NAMES, np.arange(MARKERS)), head="markers", head_markers=NAMES[:4], neutral=(0, 5)
    )
    solution, _ = solve_take(
        MarkerTake(NAMES, TIMES, turned), BoundPoints.linear(FACE, basis, SHAPES), setup
    )
    np.testing.assert_allclose(solution.weights.weights, TRUTH, atol=1e-5)


def test_symmetry_brings_left_and_right_together_by_their_names() -> None:
    """Left and right differ in the take; what they have in common stays."""
    rng = np.random.default_rng(3)
    truth = np.stack([0.3 + RISE / 3, 0.5 * RISE, 0.7 - RISE / 3], axis=1)
    noisy = FACE + np.einsum("fs,smi->fmi", truth, BASIS) + 2e-4 * rng.normal(size=POSITIONS.shape)
    names = ("smileLeft", "jawOpen", "smileRight")

    def apart(symmetry: float) -> float:
        setup = RetargetSetup(
            Binding(NAMES, np.arange(MARKERS)),
            head="stabilised",
            neutral=None,
            solve=SolveOptions(symmetry=symmetry),
        )
        take = MarkerTake(NAMES, TIMES, noisy)
        weights = solve_take(take, BoundPoints.linear(FACE, BASIS, names), setup)[0].weights
        np.testing.assert_allclose(weights.column("jawOpen"), 0.5 * RISE, atol=0.1)
        return float(np.abs(weights.column("smileLeft") - weights.column("smileRight")).max())

    assert apart(0.0) > 0.35
    assert apart(1e6) < 0.05
