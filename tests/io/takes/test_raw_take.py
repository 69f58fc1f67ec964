from dataclasses import replace

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.takes.raw_take import RawTake, check_size, finish_take
from usdface.options import TakeOptions

RNG = np.random.default_rng(3)


@pytest.fixture
def raw(tmp_path):
    def make(positions=None, labels=None, **more):
        positions = RNG.normal(size=(4, 2, 3)) if positions is None else positions
        labels = tuple("ABCDEFGH"[: positions.shape[1]]) if labels is None else labels
        more = {"rate": 60.0, "unit": 0.001, "up_axis": "Y"} | more
        return RawTake(path=tmp_path / "take.c3d", labels=labels, positions=positions, **more)

    return make


def codes(findings):
    return [f.code for f in findings]


def test_a_complete_file_gives_no_finding(raw):
    given = raw()
    take, findings = finish_take(given, TakeOptions())
    np.testing.assert_allclose(take.positions, given.positions / 1000)
    assert findings == []
    assert (take.source, take.rate, take.meters_per_unit) == ("take.c3d", 60, 0.001)


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1), ("in", 0.0254)])
def test_units_of_the_options_override_the_file(raw, unit, metres):
    given = raw(unit=0.5)
    take, _ = finish_take(given, TakeOptions(units=unit))
    np.testing.assert_allclose(take.positions, given.positions * metres)
    assert take.meters_per_unit == metres


def test_z_up_turns_without_mirroring(raw):
    x, y, z = np.eye(3)
    take, _ = finish_take(raw(np.array([[x, y, z]]), up_axis="Z", unit=1.0), TakeOptions())
    turned = take.positions[0]
    np.testing.assert_array_equal(turned[2], [0, 1, 0])  # what was up is up
    np.testing.assert_array_equal(np.cross(turned[0], turned[1]), turned[2])
    assert take.up_axis == "Z"


def test_what_the_file_does_not_say_is_announced(raw):
    take, findings = finish_take(raw(unit=None, up_axis=None, assumed_unit="cm"), TakeOptions())
    assert codes(findings) == ["UNITS_ASSUMED", "UP_AXIS_ASSUMED"]
    assert take.meters_per_unit == 0.01
    options = TakeOptions(units="m", up_axis="Z")
    assert finish_take(raw(unit=None, up_axis=None), options)[1] == []


def test_an_unknown_unit_is_named(raw):
    take, (found,) = finish_take(raw(unit=None, unit_name="furlong"), TakeOptions())
    assert found.code == "UNITS_ASSUMED"
    assert found.message == "'furlong' is no known unit of length; taken as mm"
    assert found.values == {"found": "furlong", "unit": "mm"}
    assert take.meters_per_unit == 0.001
    assert finish_take(raw(unit=None, unit_name="furlong"), TakeOptions(units="m"))[1] == []
    take, findings = finish_take(raw(unit=None, unit_name="Meters"), TakeOptions())
    assert (take.meters_per_unit, findings) == (1.0, [])


def test_image_markers_are_pixels_with_y_turned_up(raw):
    options = TakeOptions(
        dimension=2, image_size=(640, 480), focal_length=500.0, units="mm", up_axis="Z"
    )
    given = raw(unit=None, up_axis=None)
    take, findings = finish_take(given, options)
    np.testing.assert_array_equal(take.positions, given.positions[..., :2] * [1, -1])
    assert (take.meters_per_unit, take.up_axis, take.image_size) == (1.0, "Y", (640, 480))
    assert take.focal_length == 500.0
    assert findings == []


def test_dots_keep_their_diameter_and_those_that_are_never_seen_go(raw):
    positions = np.ones((2, 3, 2))
    positions[:, 1] = np.nan
    given = replace(
        raw(positions), labels=("a", "b", "c"), diameters=np.array([8.0, 9.0, 10.0]), deviation=0.2
    )
    take, _ = finish_take(given, TakeOptions())
    assert take.names == ("a", "c")
    assert take.diameters.tolist() == [8.0, 10.0]
    assert take.deviation == 0.2


def test_two_coordinates_are_an_image_and_never_space(raw):
    flat = raw(np.ones((2, 1, 2)))
    assert finish_take(flat, TakeOptions())[0].dimension == 2
    with pytest.raises(InputError, match="needs z"):
        finish_take(flat, TakeOptions(dimension=3))


def test_occlusion_is_whole_and_announced(raw):
    positions = np.ones((3, 3, 3))
    positions[1, 0, 2] = np.nan
    positions[2, 1, 0] = np.inf
    positions[:, 2] = np.nan
    take, findings = finish_take(raw(positions), TakeOptions())
    assert take.names == ("A", "B")
    np.testing.assert_array_equal(take.visible, [[1, 1], [0, 1], [1, 0]])
    assert codes(findings) == ["MARKER_NEVER_SEEN", "MARKER_OCCLUDED", "MARKER_OCCLUDED"]
    assert findings[0].where.endswith("C")
    positions[0, 1] = np.nan  # the finding that is printed of many is that of the worst
    assert finish_take(raw(positions), TakeOptions())[1][1].where.endswith("B")


def test_frames_that_repeat_the_one_before_are_announced(raw):
    positions = np.repeat(0.05 * np.random.default_rng(1).normal(size=(30, 2, 3)), 2, axis=0)
    for computed, told in ((False, True), (True, False)):  # a skeleton is no recording of markers
        _, findings = finish_take(raw(positions, computed=computed), TakeOptions())
        assert ("FRAMES_REPEATED" in [f.code for f in findings]) == told


def test_a_marker_at_the_origin_far_from_the_face_is_announced_and_left_out(raw):
    positions = np.ones((3, 4, 3)) * [[100.0], [110.0], [0.0], [120.0]]
    take, findings = finish_take(raw(positions, labels=tuple("ABCD")), TakeOptions())
    assert take.names == ("A", "B", "D")
    spike, never = findings
    assert (spike.code, never.code) == ("MARKER_SPIKE", "MARKER_NEVER_SEEN")
    assert spike.message.endswith("never seen: C") and never.where.endswith("C")
    joints = raw(positions, labels=tuple("ABCD"), computed=True)
    assert finish_take(joints, TakeOptions())[0].names == tuple("ABCD")


def test_frames_without_any_marker_are_named(raw):
    positions = np.ones((4, 1, 3))
    positions[[1, 3]] = np.nan
    _, findings = finish_take(raw(positions), TakeOptions())
    assert codes(findings) == ["MARKER_OCCLUDED", "FRAME_EMPTY"]
    assert "1, 3" in findings[1].message


def test_a_take_in_which_nothing_is_visible_is_refused(raw):
    with pytest.raises(InputError, match=r"take\.c3d: no marker is visible"):
        finish_take(raw(np.full((3, 2, 3), np.nan)), TakeOptions())


def test_no_marker_is_refused(raw):
    with pytest.raises(InputError, match="no markers"):
        finish_take(raw(np.empty((3, 0, 3))), TakeOptions())


@pytest.mark.parametrize(
    ("labels", "names"),
    [
        (("Face:Chin", "Face:Nose"), ("Chin", "Nose")),
        (("L:Chin", "R:Chin", "R:Nose"), ("L:Chin", "R:Chin", "Nose")),
        (("A", "A", "A_2", "A"), ("A", "A_3", "A_2", "A_4")),
        (("", " B ", ""), ("marker_1", "B", "marker_3")),
        (("S:", "B"), ("S:", "B")),
    ],
)
def test_labels_become_unique_names(raw, labels, names):
    take, findings = finish_take(raw(np.ones((1, len(labels), 3)), labels), TakeOptions())
    assert take.names == names
    changed = tuple(label.strip() for label in labels) != names
    code = "LABEL_REPEATED" if labels.count("A") > 1 else "LABEL_CHANGED"
    assert codes(findings) == [code] * changed


def test_many_equal_labels_take_no_time_squared(raw):
    take, _ = finish_take(raw(np.ones((1, 20000, 3)), ("A",) * 20000), TakeOptions())
    assert len(set(take.names)) == 20000


def test_the_input_array_is_not_written_to(raw):
    positions = np.ones((2, 1, 3))
    positions[0, 0, 0] = np.nan
    before = positions.copy()
    finish_take(raw(positions, unit=1.0), TakeOptions())
    np.testing.assert_array_equal(positions, before)


def test_sizes_out_of_proportion_are_refused_before_allocation(tmp_path):
    path = tmp_path / "small.csv"
    path.write_bytes(b"x" * 1000)
    check_size(path, 100, 100)
    with pytest.raises(InputError, match="is it damaged"):
        check_size(path, 10**6, 10**6)
