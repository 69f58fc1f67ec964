import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from usdface.figures import footage_sheet
from usdface.footage.tracks import Tracks

pytest.importorskip("matplotlib", reason="figures need usdface[plot]")
SIZE = (400, 300)


def footage(places: np.ndarray, names: tuple[str, ...]) -> SimpleNamespace:
    """A grey film with dots at `places` (F, M, 2), NaN where they are occluded."""
    known = np.isfinite(places[..., 0])
    ellipses = np.where(known[..., None], [6.0, 5.0, 0.0], np.nan)
    tracks = Tracks(names, places, np.where(known, 0.1, np.nan), ellipses, known * 1.0)
    grey = np.full((SIZE[1], SIZE[0], 3), 0.5)
    film = SimpleNamespace(header=SimpleNamespace(size=SIZE), frame=lambda _: grey)
    return SimpleNamespace(film=film, tracks=tracks)


def drawn_figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that are drawn from now on, instead of being written."""
    figures: list[Any] = []

    def keep(draw: Any, path: Path) -> None:
        from matplotlib.figure import Figure

        figure = Figure(layout="constrained", dpi=110)
        draw(figure)
        figure.draw_without_rendering()
        figures.append(figure)

    monkeypatch.setattr(footage_sheet, "save_figure", keep)
    return figures


def overlaps(texts: list[Any]) -> int:
    """Return the number of pairs of texts that cover each other."""
    boxes = [text.get_window_extent() for text in texts]
    return sum(
        one.x0 < other.x1 and other.x0 < one.x1 and one.y0 < other.y1 and other.y0 < one.y1
        for i, one in enumerate(boxes)
        for other in boxes[:i]
    )


def test_names_of_dots_that_are_near_to_each_other_do_not_overlap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = tuple(f"lip_corner_{i:02d}" for i in range(20))
    grid = np.stack(np.meshgrid(np.arange(5), np.arange(4)), axis=-1).reshape(1, 20, 2)
    places = 40.0 + [35.0, 45.0] * grid
    places[0, 7] = np.nan
    figures = drawn_figures(monkeypatch)
    footage_sheet.write_footage_sheet(footage(places, names), tmp_path / "a.png")  # type: ignore[arg-type]
    (figure,) = figures
    drawn = figure.axes[0].texts
    assert figure.axes[0].get_xlabel() == "occluded: lip_corner_07"
    assert [text.get_text() for text in drawn] == [n for n in names if n != names[7]]
    assert overlaps(drawn) == 0


def test_captions_of_many_occluded_markers_do_not_overlap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = tuple(f"mm_{i:02d}" for i in range(40))
    places = np.full((12, 40, 2), np.nan)
    places[:, :10] = 60.0 + 20.0 * np.arange(10)[:, None]
    figures = drawn_figures(monkeypatch)
    footage_sheet.write_footage_sheet(footage(places, names), tmp_path / "a.png")  # type: ignore[arg-type]
    captions = [axis.xaxis.label for axis in figures[0].axes[:12]]
    assert all("and 16 more" in caption.get_text().replace("\n", " ") for caption in captions)
    assert overlaps(captions) == 0


def test_many_occluded_markers_are_counted(tmp_path: Path) -> None:
    names = tuple(f"m{i}" for i in range(40))
    places = np.full((2, 40, 2), np.nan)
    places[:, 0] = (150.0, 100.0)
    places[0, 1] = (200.0, 120.0)
    path = tmp_path / "a.svg"
    footage_sheet.write_footage_sheet(footage(places, names), path)  # type: ignore[arg-type]
    text = " ".join(re.findall(r"<!-- (.*?) -->", path.read_text(), re.DOTALL))
    assert "and 24 more" in text and "and 25 more" in text
