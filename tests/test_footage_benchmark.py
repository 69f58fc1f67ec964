"""The judge of footage, small: a rendered head, a few images, the truth of its dots."""

from pathlib import Path

import numpy as np
import pytest

from usdface import read_rig
from usdface.io.images.footage import read_footage
from usdface.options import TakeOptions

FRAMES = 6


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_weights_of_true_projections_are_those_of_the_film(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1]))
    from benchmarks.footage.film import example_film, swaying
    from benchmarks.footage.weights import HEAD, REST, rms, solved_weights, write_true_take

    names = read_rig(HEAD)[0].mesh("head").shape_names
    grows = np.clip((np.arange(REST + 15) - REST) / 10.0, 0.0, 1.0)
    shown = {"jawOpen": 0.5, "mouthSmileLeft": 0.7, "browInnerUp": 0.8}
    weights = grows[:, None] * [shown.get(name, 0.0) for name in names]
    angles, shift = (grows[:, None] * each for each in swaying(len(grows), 30.0, 20.0))
    film = example_film(weights, names, angles, shift)
    take = tmp_path / "true.usdc"
    write_true_take(film, film.camera.project(film.points[:, film.vertices]), take)
    solved = solved_weights(film, film.names, take, {})
    peak = dict(zip(names, solved[-1].tolist(), strict=True))
    assert all(peak[name] == pytest.approx(value, abs=0.1) for name, value in shown.items())
    assert rms(solved - weights) < 0.06
