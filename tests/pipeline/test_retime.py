"""A take moved or played slower by a layer offset: the result is where USD plays the take."""

from pathlib import Path

import numpy as np
import pytest
from processed import EXACT
from pxr import Sdf, Usd
from worlds import animation_of, make_world

from usdface.pipeline import make_shot, process

FILES = ("rig.usda", "take.usda", "shot.usda")
ARC = "@./take.usda@</Take>"


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = make_world().write(tmp_path_factory.mktemp("plain"))
    make_shot(*(folder / name for name in FILES), bind=folder / "bind.json")
    process(folder / "shot.usda")
    return folder


def retimed(plain: Path, folder: Path, arc: str, offset: float, scale: float) -> Path:
    """Return the shot with its take referenced, or itself sublayered, with offset and scale."""
    for name in FILES:
        folder.joinpath(name).write_text((plain / name).read_text())
    shot = folder / "shot.usda"
    if arc == "reference":
        text = shot.read_text()
        assert ARC in text
        shot.write_text(text.replace(ARC, f"{ARC} (offset = {offset}; scale = {scale})"))
        return shot
    edit = Sdf.Layer.CreateNew(str(folder / "edit.usda"))
    source = Sdf.Layer.FindOrOpen(str(shot))
    for key in ("timeCodesPerSecond", "framesPerSecond", "metersPerUnit", "upAxis", "defaultPrim"):
        if source.pseudoRoot.HasInfo(key):
            edit.pseudoRoot.SetInfo(key, source.pseudoRoot.GetInfo(key))
    edit.subLayerPaths = ["./shot.usda"]
    edit.subLayerOffsets[0] = Sdf.LayerOffset(offset, scale)
    edit.Save()
    return folder / "edit.usda"


@pytest.mark.slow
@pytest.mark.parametrize("arc", ["reference", "sublayer"])
@pytest.mark.parametrize(("offset", "scale"), [(1000.0, 1.0), (-12.5, 1.0), (100.0, 2.0)])
def test_the_result_plays_where_the_take_does(
    plain: Path, tmp_path: Path, arc: str, offset: float, scale: float
) -> None:
    shot = retimed(plain, tmp_path, arc, offset, scale)
    result = process(shot)
    stage = Usd.Stage.Open(str(result.written[0]))
    codes = stage.GetPrimAtPath("/Shot/Capture/Take").GetAttribute("points").GetTimeSamples()
    played = animation_of(result.written[0])
    before = animation_of(plain / "shot.usdface.usda")
    np.testing.assert_allclose(played.times, offset + scale * before.times, atol=1e-9)
    np.testing.assert_allclose(played.times, codes, atol=1e-9)
    if scale == 1.0:
        np.testing.assert_allclose(played.weights, before.weights, atol=EXACT)
    else:  # slower motion is smoothed over as much time, not as many frames
        np.testing.assert_allclose(played.weights, before.weights, atol=0.2)
    assert result.value.shot.take.times[-1] == pytest.approx(
        scale * (len(before.times) - 1) / make_world().take.rate
    )


@pytest.mark.slow
def test_a_cut_is_on_the_timeline_of_the_shot(plain: Path, tmp_path: Path) -> None:
    shot = retimed(plain, tmp_path, "reference", 1000.0, 2.0)
    process(shot, deliver=tmp_path / "face.usdc")
    clean = Usd.Stage.Open(str(tmp_path / "face.usdc"))
    (animation,) = [p for p in clean.Traverse() if p.GetTypeName() == "SkelAnimation"]
    codes = animation.GetAttribute("blendShapeWeights").GetTimeSamples()
    frames = 2 * (len(make_world().take.times) - 1)
    assert codes == [1000.0 + k for k in range(frames + 1)]
