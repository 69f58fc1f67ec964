"""A focal length in millimetres, given as pixels, is no lens's."""

from pathlib import Path

import numpy as np
import pytest

from usdface.io.takes.field_of_view import report_field_of_view
from usdface.io.takes.files import read_take
from usdface.options import TakeOptions
from usdface.takes import MarkerTake


def of_film(focal: float, size: tuple[int, int] | None = (1280, 720)) -> MarkerTake:
    return MarkerTake(
        ("a",), np.arange(2.0), np.zeros((2, 1, 2)), 1.0, image_size=size, focal_length=focal
    )


@pytest.mark.parametrize("focal", [0.0, 360.0, 900.0, 1.2e4])
def test_lenses_are_no_finding(focal: float) -> None:
    assert report_field_of_view(of_film(focal), Path("a.csv")) == []


def test_without_the_size_of_the_image_nothing_is_known() -> None:
    assert report_field_of_view(of_film(50.0, None), Path("a.csv")) == []


@pytest.mark.parametrize(
    ("focal", "degrees", "hint"),
    [
        (50.0, 171.1, "(50 mm on a sensor of 36 mm: 1778 px)"),
        (0.05, 180.0, ""),
        (1e5, 0.7, ""),
    ],
)
def test_what_no_lens_shows(focal: float, degrees: float, hint: str) -> None:
    (found,) = report_field_of_view(of_film(focal), Path("a.csv"))
    assert (found.code, found.severity) == ("FOCAL_LENGTH_UNUSUAL", "warning")
    assert found.values["field_degrees"] == pytest.approx(degrees, abs=0.1)
    assert found.message.endswith(f"the image's width [px]{' ' + hint if hint else ''}")


def test_millimetres_are_reported_where_a_take_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("frame,landmark,x,y\n0,1,0.5,0.5\n1,1,0.5,0.5\n")
    _, found = read_take(path, TakeOptions(rate=25.0, image_size=(1280, 720), focal_length=50.0))
    assert "FOCAL_LENGTH_UNUSUAL" in [each.code for each in found]
