import numpy as np
import pytest

from usdface.errors import InputError
from usdface.takes import MarkerTake, visible

RNG = np.random.default_rng(3)


def markers(positions: object = None, **changes: object) -> MarkerTake:
    made = RNG.normal(size=(4, 3, 3)) if positions is None else positions
    given = {"names": ("a", "b", "c"), "times": np.arange(4) / 30, "positions": made}
    return MarkerTake(**(given | changes))  # type: ignore[arg-type]


def test_a_take_cannot_be_changed() -> None:
    take = markers()
    for array in (take.positions, take.times):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(AttributeError):
        take.rate = 24.0  # type: ignore[misc]


def test_some_markers_of_a_take_are_those() -> None:
    take = markers(diameters=[0.004, np.nan, 0.002])
    some = take.with_markers(np.array([2, 0]))
    assert some.names == ("c", "a")
    np.testing.assert_array_equal(some.positions, take.positions[:, [2, 0]])
    assert some.diameters is not None and some.diameters.tolist() == [0.002, 0.004]
    assert markers().with_markers(np.array([True, False, True])).names == ("a", "c")


@pytest.mark.parametrize("deviation", [-0.1, np.nan, np.inf, 1e300])
def test_a_deviation_that_is_none_is_refused(deviation: float) -> None:
    with pytest.raises(InputError, match="deviation"):
        markers(deviation=deviation)


@pytest.mark.parametrize("diameter", [-0.1, 0.0, np.inf, 1e300])
def test_a_diameter_that_is_none_is_refused(diameter: float) -> None:
    with pytest.raises(InputError, match="diameters"):
        markers(diameters=[0.004, np.nan, diameter])


@pytest.mark.parametrize("blink", [[0.0, 1.0], [0.0, 0.1, 1.1, 0.0], [0.0, -0.1, 0.0, 0.0]])
def test_blinks_that_are_none_are_refused(blink: list[float]) -> None:
    with pytest.raises(InputError, match="blinks"):
        markers(blink=blink)


def test_some_frames_of_a_take_are_those() -> None:
    take = markers(blink=[0.0, 0.5, np.nan, 1.0])
    some = take.with_frames(slice(1, 3))
    assert some.times.tolist() == take.times[1:3].tolist()
    np.testing.assert_array_equal(some.positions, take.positions[1:3])
    np.testing.assert_array_equal(some.blink, [0.5, np.nan])
    assert markers().with_frames(np.array([0, 3])).blink is None


def test_a_take_does_not_follow_the_array_it_was_made_of() -> None:
    positions = np.ones((4, 3, 3))
    take, part = markers(positions), markers(positions[:, ::1])
    positions[:] = 7.0
    assert (take.positions == 1).all() and (part.positions == 1).all()


def test_a_hidden_marker_is_nan_in_all_components() -> None:
    positions = RNG.normal(size=(4, 3, 3))
    positions[1, 2] = np.nan
    take = markers(positions)
    expected = np.ones((4, 3), dtype=bool)
    expected[1, 2] = False
    np.testing.assert_array_equal(take.visible, expected)
    np.testing.assert_array_equal(visible(take.positions[1]), expected[1])
    positions[0, 0, 1] = np.nan
    with pytest.raises(InputError, match="all components"):
        markers(positions)


def test_select_goes_by_name_in_the_order_asked() -> None:
    take = markers()
    np.testing.assert_array_equal(take.select(("c", "a")), take.positions[:, [2, 0]])
    assert take.select(()).shape == (4, 0, 3)
    with pytest.raises(InputError, match="'x', 'y'; it has a, b, c"):
        take.select(("a", "x", "y"))


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_dimension_is_the_arrays(dimension: int) -> None:
    assert markers(np.zeros((4, 3, dimension))).dimension == dimension


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"names": ("a", "b")}, "expected (frames, 2 markers"),
        ({"names": ("a", "b", "a")}, "'a' occurs twice"),
        ({"names": (), "positions": np.zeros((4, 0, 3))}, "no markers"),
        ({"positions": np.zeros((4, 3, 4))}, "2 or 3"),
        ({"positions": np.zeros((0, 3, 3)), "times": []}, "no frames"),
        ({"positions": np.full((4, 3, 3), np.inf)}, "finite"),
        ({"times": [0.0, 1.0, 2.0]}, "3 times for 4 frames"),
        ({"times": [0.0, 1.0, 1.0, 2.0]}, "increasing"),
        ({"times": [0.0, 1.0, np.nan, 2.0]}, "increasing"),
        ({"up_axis": "X"}, "'X'"),
    ],
)
def test_markers_that_make_no_take(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        markers(**changes)
    assert message in str(caught.value)
