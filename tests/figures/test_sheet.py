import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from processed import shoot
from worlds import make_world

from usdface.cli import main

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shoot(make_world(head_moves=False).write(tmp_path_factory.mktemp("sheet")))


@pytest.mark.slow
def test_the_sheet_names_frames_reasons_and_residuals(
    shot: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "sheet.svg"
    assert main(["process", str(shot), "--sheet", str(path)]) == 0
    assert f"wrote {path}" in capsys.readouterr().out
    content = path.read_text()
    for text in ("rest", "residual", "solved", "corrected", "changed by"):
        assert text in content, text


@pytest.mark.slow
def test_many_reasons_take_two_lines(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line of them would cover the next picture's."""
    many = "correction, residual, brows, cheeks, jaw, mouth"
    monkeypatch.setattr("usdface.figures.sheet.sheet_frames", lambda *_: {0: many, 1: "rest"})
    path = tmp_path / "sheet.svg"
    assert main(["process", str(shot), "--sheet", str(path)]) == 0
    drawn = path.read_text()
    assert many not in drawn
    assert "correction, residual, brows," in drawn and "cheeks, jaw, mouth" in drawn
    width = float(re.search(r'<svg [^>]*?width="([\d.]+)pt"', drawn, re.DOTALL)[1])
    assert width == pytest.approx(2 * 250 / 110 * 72)  # as wide as its two pictures


@pytest.mark.slow
def test_captions_keep_a_distance_from_the_heads_of_the_next_row(
    shot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = {frame: "rest" for frame in range(12)}
    monkeypatch.setattr("usdface.figures.sheet.sheet_frames", lambda *_: names)
    distances = []

    def measure(draw: Callable[[Any], None], _: Path) -> None:
        figure = Figure(layout="constrained")
        draw(figure)
        figure.draw_without_rendering()
        upper, lower = (block.axes for block in figure.subfigs)
        captions = [axis.xaxis.label.get_window_extent() for axis in upper if axis.get_xlabel()]
        heads = [axis.title.get_window_extent() for axis in lower if axis.get_title()]
        assert len(captions) == len(heads) == 6
        distances.append(min(c.y0 for c in captions) - max(h.y1 for h in heads))
        distances[-1] /= figure.dpi

    monkeypatch.setattr("usdface.figures.sheet.save_figure", measure)
    main(["process", str(shot), "--sheet", str(tmp_path / "sheet.png")])
    assert distances and distances[0] > 0.15  # inches: a line of text


@pytest.mark.slow
def test_the_same_result_gives_the_same_bytes(shot: Path, tmp_path: Path) -> None:
    drawn = []
    for name in ("one.png", "two.png"):
        assert main(["process", str(shot), "--sheet", str(tmp_path / name)]) == 0
        drawn.append((tmp_path / name).read_bytes())
    assert drawn[0].startswith(PNG) and drawn[0] == drawn[1]


@pytest.mark.parametrize("option", ["--sheet", "--figure"])
def test_the_want_of_matplotlib_is_told_before_the_work(
    shot: Path,
    tmp_path: Path,
    option: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("solved before the check")

    monkeypatch.setattr("usdface.figures.picture.find_spec", lambda _: None)
    monkeypatch.setattr("usdface.pipeline.processing.retarget_run", work)
    assert main(["process", str(shot), option, str(tmp_path / "a.png")]) != 0
    assert "usdface[plot]" in capsys.readouterr().err
