import numpy as np
import pytest

from usdface.io.takes.files import read_take
from usdface.io.takes.raw_take import RawTake, finish_take
from usdface.io.takes.take_size import marker_radius, report_take_size
from usdface.options import TakeOptions

FACE = np.random.default_rng(7).normal(scale=0.037, size=(30, 20, 3))  # half within 0.06 m


def test_the_radius_is_that_of_half_of_the_markers_in_most_frames():
    ring = np.zeros((3, 5, 3))
    ring[:, 1:, 0], ring[:, 1:, 1] = [0.1, -0.1, 0.0, 0.0], [0.0, 0.0, 0.1, -0.1]
    ring[1] *= 50.0  # one frame of three
    assert marker_radius(ring + np.array([1.0, 2.0, 3.0])) == pytest.approx(0.1)


def test_occluded_and_stray_markers_do_not_count():
    places = FACE.copy()
    size = marker_radius(places)
    places[:, :3] = np.nan
    places[:10] = np.nan
    places[:, 4] += 1000.0
    assert marker_radius(places) == pytest.approx(size, rel=0.15)


@pytest.mark.parametrize("places", [FACE[:, :3], np.full((4, 9, 3), np.nan), np.ones((4, 9, 3))])
def test_takes_without_a_size_are_not_judged(tmp_path, places):
    assert report_take_size(tmp_path / "a.c3d", places * 1e4, 1.0) == []


@pytest.mark.parametrize("factor", [0.2, 1.0, 10.0])  # lips alone, a face, a body
def test_what_may_be_a_person_is_not_reported(tmp_path, factor):
    assert report_take_size(tmp_path / "a.c3d", FACE * factor, 0.001) == []


@pytest.mark.parametrize(
    ("factor", "unit", "used", "fits"),
    [
        (1000.0, 1.0, "m", "mm"),
        (25.4, 0.0254, "in", "mm"),
        (0.1, 0.001, "mm", "cm"),
        (0.001, 0.001, "mm", "m"),
    ],
)
def test_the_size_the_unit_and_one_that_fits_are_named(tmp_path, factor, unit, used, fits):
    (found,) = report_take_size(tmp_path / "a.c3d", FACE * factor, unit)
    size = marker_radius(FACE) * factor
    assert (found.code, found.severity, found.action) == (
        "TAKE_SIZE_UNUSUAL",
        "warning",
        "name_unit",
    )
    assert found.values == {"unit": used, "size_m": pytest.approx(size, rel=1e-4)}
    assert f"within {size:.2g} m" in found.message
    assert "--units" in found.message and f"({fits} gives 0.05" in found.message


def test_no_unit_is_proposed_where_none_fits(tmp_path):
    (found,) = report_take_size(tmp_path / "a.c3d", FACE * 5000.0, 0.001)
    assert found.message.endswith("--units")


def test_each_take_in_space_is_judged_in_the_unit_that_counts(tmp_path):
    labels = tuple(f"m{number}" for number in range(20))
    raw = RawTake(
        path=tmp_path / "a.c3d", labels=labels, positions=FACE * 1e3, rate=60.0, up_axis="Y"
    )

    def codes(**options):
        return [found.code for found in finish_take(raw, TakeOptions(**options))[1]]

    assert codes() == ["UNITS_ASSUMED"]
    assert codes(units="mm") == []
    assert codes(units="m") == ["TAKE_SIZE_UNUSUAL"]
    assert codes(dimension=2) == []


@pytest.mark.parametrize(
    "name",
    ["Optotrak.c3d", "Qualisys.c3d", "markers.trc", "markers_analogs.c3d"],
)
def test_real_bodies_are_not_reported(shared_data, name):
    _, findings = read_take(shared_data / "c3d_trc_body" / name)
    assert "TAKE_SIZE_UNUSUAL" not in [found.code for found in findings]


def test_a_real_face_in_metres_is_reported(shared_data):
    path = shared_data / "animface/Jaw.c3d"
    codes = {
        unit: [found.code for found in read_take(path, TakeOptions(units=unit))[1]]
        for unit in ("mm", "m")
    }
    assert "TAKE_SIZE_UNUSUAL" in codes["m"] and "TAKE_SIZE_UNUSUAL" not in codes["mm"]
