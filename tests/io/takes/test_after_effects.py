import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.after_effects import read_after_effects
from usdface.options import TakeOptions

HEAD = (
    "Adobe After Effects 8.0 Keyframe Data\n\n\tUnits Per Second\t29.97\n\tSource Width\t720\n"
    "\tSource Height\t576\n\tSource Pixel Aspect Ratio\t{}\n\tComp Pixel Aspect Ratio\t1\n\n"
)
POINT = "\tFrame\tX pixels\tY pixels\n\t3\t10\t20\n\t4\t11\t20\n\n"


@pytest.fixture
def read(tmp_path):
    def read(text, **options):
        path = tmp_path / "a.txt"
        path.write_text(text)
        return read_after_effects(path, TakeOptions(**options))

    return read


def test_pixels_that_are_not_square_are_stretched(read):
    take, _ = read(HEAD.format(1.5) + "Transform\tPosition\n" + POINT)
    assert (take.image_size, take.rate, take.names) == ((1080, 576), 29.97, ("Position",))
    np.testing.assert_allclose(take.positions[:, 0], [[15, -20], [16.5, -20]])


def test_a_size_that_is_given_is_stretched_as_the_places_are(read):
    take, _ = read(HEAD.format(1.5) + "Transform\tPosition\n" + POINT, image_size=(720, 576))
    assert take.image_size == (1080, 576)


def test_names_keep_what_tells_points_apart(read):
    text = HEAD.format(1)
    for name in ("Effects\tPoint Control #2\tPoint", "Effects\tCorner Pin #1\tUpper Left"):
        text += name + "\n" + POINT
    text += "Motion Trackers\tTracker #1\tTrack Point #1\tFeature Center #4\n" + POINT
    take, _ = read(text)
    assert take.names == (
        "Point Control #2",
        "Corner Pin #1 Upper Left",
        "Tracker #1 Track Point #1 Feature Center #4",
    )


def test_what_is_no_moving_point_is_told(read):
    text = HEAD.format(1) + "Transform\tPosition\n" + POINT + "Transform\tAnchor Point\n" + POINT
    text += "Transform\tRotation\n\tFrame\tdegrees\n\t0\t5\n\n"
    text += "Effects\tPoint Control #9\tPoint\n\tFrame\tX pixels\tY pixels\n\t\t360\t288\n"
    take, findings = read(text)
    assert take.names == ("Position",)
    reported = next(f.message for f in findings if f.code == "CHANNEL_IGNORED")
    for name in ("Anchor Point", "Rotation", "Point Control #9"):
        assert name in reported


def test_text_without_points_is_refused(read):
    with pytest.raises(InputError, match="no property has keys in X pixels"):
        read(HEAD.format(1))
