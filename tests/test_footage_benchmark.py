"""The judge of footage, small: a rendered head, a few images, the truth of its dots."""

from pathlib import Path

import numpy as np
import pytest

from usdface.io.images.footage import read_footage
from usdface.options import TakeOptions

FRAMES = 6


def test_dots_on_a_rendered_head_are_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1]))
    from benchmarks.footage.film import Look, example_film, shoot, swaying
    from benchmarks.footage.judge import judge

    names = ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight")
    weights = np.linspace(0.0, 0.5, FRAMES)[:, None] * (1.0, 1.0, 1.0)
    angles, shift = swaying(FRAMES, 30.0, 15.0)
    film = example_film(weights, names, angles, shift, size=(640, 480))
    truth = shoot(film, Look(samples=2), tmp_path)
    _, footage, _ = read_footage(tmp_path / "face.####.png", TakeOptions(rate=30.0))
    arrays = {key: getattr(truth, key) for key in ("centroids", "vertices", "shares")}
    score = judge(footage.tracks, arrays)
    assert score.labels == 1.0 and score.invented == 0.0 and score.found > 0.85
    assert score.centroid_rms < 0.15
