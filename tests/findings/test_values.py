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
