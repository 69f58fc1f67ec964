from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from processed import EXACT, Done, processed_world, solved
from pxr import Sdf, Usd
from worlds import animation_of, restaged

from usdface.io.usd.animation import Animation, Inputs
from usdface.io.usd.animation_write import author
from usdface.io.usd.metrics import new_layer
from usdface.io.usd.played_shot import has_setup, read_played_shot
from usdface.io.usd.shot import read_shot
from usdface.schemas import tokens
from usdface.shot.played_shot import PlayedShot


@pytest.fixture(scope="module")
def played(done: Done) -> PlayedShot:
    return read_played_shot(Usd.Stage.Open(str(done.root)), "the shot")[0]


def test_both_sets_of_weights_are_those_of_the_layers(done: Done, played: PlayedShot) -> None:
    names = done.world.rig.shape_names
    final = animation_of(done.root).reordered(names).weights
    below = solved(done.root, done.world)
    np.testing.assert_allclose(played.corrected.reordered(names).weights, final, atol=1e-7)
    if (done.root.parent / "shot.usdface" / "closure.usdc").exists():
        below = read_below(done)
    np.testing.assert_allclose(played.solved.reordered(names).weights, below, atol=1e-7)
    assert np.abs(final - below).max() > 0.1


def read_below(done: Done) -> np.ndarray:
    stage = Usd.Stage.Open(str(done.root))
    for layer in stage.GetLayerStack():
        if layer.realPath.endswith(("express.usdc", "closure.usdc")):
            stage.MuteLayer(layer.identifier)
    return animation_of(stage).reordered(done.world.rig.shape_names).weights


def test_layers_are_muted_only_while_they_are_read(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.root))
    read_played_shot(stage, "the shot")
    assert not stage.GetMutedLayers()


def test_residuals_are_distances_of_the_feature_points(done: Done, played: PlayedShot) -> None:
    face = played.shot.face
    own = played.solved.reordered(face.shape_names).weights
    solved_points = face.neutral + face.displacements(own)
    order = [face.markers.index(name) for name in played.markers]
    expected = np.linalg.norm(played.feature_points - solved_points[:, order], axis=2)
    np.testing.assert_allclose(played.distances, expected, atol=2e-5)
    mean = np.sqrt(np.nanmean(played.distances**2, axis=1))
    np.testing.assert_allclose(played.residual, mean, atol=1e-6)
    assert set(played.regions) and set(played.deviations) == set(face.shape_names)


def test_rules_fire_again_as_the_layer_says(played: PlayedShot) -> None:
    evaluation = played.evaluation()
    assert evaluation is not None
    np.testing.assert_allclose(evaluation.firing, played.firing, atol=1e-6)
    assert played.unit > 0 and set(played.emotions) == set(played.shot.system.emotions)


def test_units_and_axes_of_the_stage_do_not_matter(
    tmp_path, played: PlayedShot, done: Done
) -> None:
    world = done.world
    folder = world.write(tmp_path)
    restaged(folder / "rig.usda", 0.01, "Z")
    from processed import process

    other = read_played_shot(Usd.Stage.Open(str(process(folder))), "the shot")[0]
    np.testing.assert_allclose(other.feature_points, played.feature_points, atol=1e-5)
    np.testing.assert_allclose(other.distances, played.distances, atol=1e-6)
    assert other.unit == pytest.approx(played.unit, rel=1e-5)
    np.testing.assert_allclose(other.head, played.head, atol=1e-5)


def test_a_shot_without_result_is_empty(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    assert has_setup(stage) and not has_setup(Usd.Stage.Open(str(done.folder / "rig.usda")))
    plain, _ = read_played_shot(stage, "the shot")
    assert not plain.markers and not len(plain.residual) and plain.evaluation() is None
    np.testing.assert_array_equal(plain.solved.weights, plain.corrected.weights)


@pytest.mark.slow
def test_a_result_in_place_is_read_too(tmp_path) -> None:
    from processed import run

    done = processed_world(tmp_path)
    run("process", done.folder / "shot.usda", "--in-place")
    played, _ = read_played_shot(Usd.Stage.Open(str(done.folder / "shot.usda")), "the shot")
    expected, _ = read_played_shot(Usd.Stage.Open(str(done.root)), "the shot")
    np.testing.assert_allclose(played.solved.weights, expected.solved.weights, atol=EXACT)
    np.testing.assert_allclose(played.corrected.weights, expected.corrected.weights, atol=EXACT)


def test_what_is_occluded_comes_back_as_such_and_the_layers_are_finite(
    tmp_path: Path, done: Done
) -> None:
    stage = Usd.Stage.Open(str(done.root))
    (staged, _), played = read_shot(stage, "the shot"), read_played_shot(stage, "the shot")[0]
    hidden = np.zeros(played.inputs.shape, bool)
    hidden[2, 1] = True
    layer = new_layer(staged.metrics)
    inputs = Inputs(np.where(hidden, np.nan, played.inputs), played.unit)
    content = Animation(staged.prims.tokens, played.solved.weights, None, inputs=inputs)
    content = replace(content, emotions=dict(played.emotions))
    author(layer, staged, content)
    written = [np.asarray(v) for v in samples_of(layer, tokens.INPUTS)]
    assert np.isfinite(written).all()
    layer.Export(str(tmp_path / "over.usda"))
    over = Usd.Stage.Open(str(done.root))
    over.GetSessionLayer().subLayerPaths = [str(tmp_path / "over.usda")]
    back, _ = read_played_shot(over, "the shot")
    np.testing.assert_array_equal(np.isnan(back.inputs), hidden)


def samples_of(layer: Sdf.Layer, name: str) -> list[object]:
    (path,) = (p for p in layer_paths_of(layer) if p.name == name)
    return [layer.QueryTimeSample(path, code) for code in layer.ListTimeSamplesForPath(path)]


def layer_paths_of(layer: Sdf.Layer) -> list[Sdf.Path]:
    found: list[Sdf.Path] = []
    layer.Traverse("/", found.append)
    return [path for path in found if path.IsPropertyPath()]
