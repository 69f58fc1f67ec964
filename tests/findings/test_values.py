import pytest

from usdface.findings.values import filled_in


@pytest.mark.parametrize(
    ("template", "one", "two"),
    [
        ("{count} blinks were completed", "1 blink was completed", "2 blinks were completed"),
        ("{count} curves have no name", "1 curve has no name", "2 curves have no name"),
        ("show {count} blend shapes (x)", "show 1 blend shape (x)", "show 2 blend shapes (x)"),
        ("{count} helper meshes are", "1 helper mesh is", "2 helper meshes are"),
        (
            "weights of {count} points are x",
            "weights of 1 point are x",
            "weights of 2 points are x",
        ),
        ("{count} markers lie apart", "1 markers lie apart", "2 markers lie apart"),
        ("all {count} vertices", "all 1 vertex", "all 2 vertices"),
        ("in {count:g} frames", "in 1 frame", "in 2 frames"),
        ("{count} of its points", "1 of its points", "2 of its points"),
    ],
)
def test_one_thing_is_told_in_the_singular(template: str, one: str, two: str) -> None:
    assert [filled_in(template, [n])[0] for n in (1, 2)] == [one, two]


@pytest.mark.parametrize(
    ("frames", "told"),
    [
        ([*range(25), *range(150, 230), 300], "in frames 0 to 24, 150 to 229, 300"),
        ([4, 5, 9], "in frames 4, 5, 9"),
        ([9, 8, 7], "in frames 9, 8, 7"),
        ([1, 3, 5, 7, 9, 11, 13, 15, 17, 18, 19], "in frames 1, 3, 5, 7, 9, 11, 13, 15 and 1 more"),
        (["a1", "a2", "a3"], "in frames a1, a2, a3"),
    ],
)
def test_numbers_in_a_row_are_told_as_a_range(frames: list[object], told: str) -> None:
    """Of a face that was lost for a second only the first eight frames were told."""
    text, values = filled_in("in frames {frames}", [frames])
    assert text == told and values["frames"] == frames
