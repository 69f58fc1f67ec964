"""Blender and three.js play what we wrote."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd, UsdSkel

pytestmark = pytest.mark.slow

FRAMES = [0, 54, 147, 240, 336, 428, 519, 719]
Played = list[dict[str, dict[str, float]]]


@pytest.fixture(scope="module")
def truth(example: Path) -> list[dict[str, float]]:
    """What UsdSkel plays at the frames."""
    stage = Usd.Stage.Open(str(example / "shot.usdface.usda"))
    prim = next(p for p in stage.Traverse() if p.IsA(UsdSkel.Animation))
    animation = UsdSkel.Animation(prim)
    names, weights = animation.GetBlendShapesAttr().Get(), animation.GetBlendShapeWeightsAttr()
    return [dict(zip(names, weights.Get(frame), strict=True)) for frame in FRAMES]


def largest_error(played: Played, truth: list[dict[str, float]]) -> float:
    """Compare every shape of every mesh at every frame; all of the head's must be there."""
    assert any(len(shapes) >= 50 for shapes in played[0].values())
    errors = [
        abs(value - expected[name])
        for meshes, expected in zip(played, truth, strict=True)
        for shapes in meshes.values()
        for name, value in shapes.items()
    ]
    return float(np.max(errors))


@pytest.mark.parametrize("name", ["shot.usdface.usda", "face.glb"])
def test_blender_plays_the_weights(
    example: Path,
    truth: list[dict[str, float]],
    blender: Callable[[Path, list[int]], dict[str, Any]],
    name: str,
) -> None:
    answer = blender(example / name, FRAMES)
    assert answer["meshes"] == 9
    assert largest_error(answer["frames"], truth) < 1e-5


def test_three_plays_the_weights_and_draws_a_face(
    example: Path,
    truth: list[dict[str, float]],
    three: Callable[[Path, list[float], float], dict[str, Any]],
    tmp_path: Path,
) -> None:
    # The last time is a whisker short of the end, where an action begins again.
    times = [frame / 60 for frame in FRAMES[:-1]] + [FRAMES[-1] / 60 - 1e-6]
    answer = three(example / "face.glb", times, times[0])
    assert answer["duration"] == pytest.approx(719 / 60, abs=1e-5)
    assert largest_error(answer["frames"], truth) < 1e-4
    surprised = three(example / "face.glb", times[:1], times[6])
    (tmp_path / "neutral.png").write_bytes(answer["picture"])
    (tmp_path / "surprised.png").write_bytes(surprised["picture"])
    assert len(answer["picture"]) > 10_000, "an empty canvas compresses to less"
    assert answer["picture"] != surprised["picture"]
