"""A deliverable is the animation that USD plays, on the frames of the shot, and nothing else."""

from pathlib import Path

import numpy as np
import pytest
from processed import shoot
from pxr import Sdf, Usd, UsdSkel
from worlds import animation_of, make_world

from usdface.cli import main
from usdface.errors import InputError
from usdface.options import DeliverOptions
from usdface.pipeline import process


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot of 40 frames at 30 Hz."""
    return shoot(make_world().write(tmp_path_factory.mktemp("deliver")))


def delivered(path: Path) -> tuple[Usd.Stage, list[float], np.ndarray]:
    stage = Usd.Stage.Open(str(path))
    weights = UsdSkel.Animation(stage.GetDefaultPrim()).GetBlendShapeWeightsAttr()
    codes = weights.GetTimeSamples()
    return stage, codes, np.array([weights.Get(code) for code in codes])


def test_it_holds_the_animation_alone(shot: Path) -> None:
    place = shot.with_name("face.usda")
    result = process(shot, deliver=place)
    assert result.written[-1] == place
    stage, codes, weights = delivered(place)
    (prim,) = stage.Traverse()
    assert prim.GetTypeName() == "SkelAnimation"
    assert [x.realPath for x in stage.GetUsedLayers() if not x.anonymous] == [str(place)]
    # Beside the animation only the mark by which the next run knows it.
    assert list(stage.GetRootLayer().customLayerData["usdface"]) == ["fingerprint"]
    assert "usdface:" not in place.read_text() and "UsdFace" not in place.read_text()
    assert codes == list(range(40))
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (30, 30)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 39)
    played = animation_of(result.written[0])
    names = tuple(UsdSkel.Animation(prim).GetBlendShapesAttr().Get())
    assert np.array_equal(weights, played.reordered(names).weights.astype(np.float32))


def test_a_rate_of_too_many_frames_is_named(shot: Path) -> None:
    with pytest.raises(InputError, match=r"at 1e\+09 frames a second.*a lower rate") as raised:
        process(shot, deliver=shot.with_name("fast.usda"), delivery=DeliverOptions(rate=1e9))
    assert raised.value.code == "SETTING_WRONG"


@pytest.mark.slow
def test_a_range_has_handles_and_a_rate_of_its_own(shot: Path) -> None:
    place = shot.with_name("cut.usdc")
    options = DeliverOptions(start=8, end=20, handles=3, rate=24.0)
    result = process(shot, deliver=place, delivery=options)
    assert "RANGE_OUTSIDE" not in {finding.code for finding in result.findings}
    stage, codes, weights = delivered(place)
    assert codes == list(range(5, 24)) and stage.GetFramesPerSecond() == 24
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (8, 20)
    played = animation_of(result.written[0])
    names = tuple(UsdSkel.Animation(stage.GetDefaultPrim()).GetBlendShapesAttr().Get())
    known = played.reordered(names).weights
    at = np.array(codes) * 30 / 24
    wanted = np.array([np.interp(at, np.arange(40), column) for column in known.T]).T
    assert np.allclose(weights, wanted, atol=1e-6)


def test_what_the_take_lacks_is_said(shot: Path) -> None:
    place = shot.with_name("lacks.usda")
    result = process(shot, deliver=place, delivery=DeliverOptions(start=2, end=38, handles=8))
    assert "RANGE_OUTSIDE" in {finding.code for finding in result.findings}
    assert delivered(place)[1] == list(range(40))
    unwritten = shot.with_name("unwritten.usda")
    with pytest.raises(InputError, match="are not in the take, which has 0 to 39"):
        process(shot, output=unwritten, deliver=place, delivery=DeliverOptions(start=50, end=60))
    assert not unwritten.exists()


@pytest.mark.slow
def test_a_layer_offset_retimes_it(shot: Path) -> None:
    over = Sdf.Layer.CreateNew(str(shot.with_name("retimed.usda")))
    over.subLayerPaths = ["./shot.usda"]
    over.subLayerOffsets[0] = Sdf.LayerOffset(1001, 2)
    stage = Usd.Stage.Open(str(shot))
    over.timeCodesPerSecond = over.framesPerSecond = 30
    over.pseudoRoot.SetInfo("metersPerUnit", stage.GetMetadata("metersPerUnit"))
    over.pseudoRoot.SetInfo("upAxis", stage.GetMetadata("upAxis"))
    over.Save()
    slow = shot.with_name("slow.usda")
    result = process(shot.with_name("retimed.usda"), deliver=slow)
    stage, codes, weights = delivered(slow)
    assert codes == list(range(1001, 1001 + 79))
    played = animation_of(result.written[0])
    names = tuple(UsdSkel.Animation(stage.GetDefaultPrim()).GetBlendShapesAttr().Get())
    assert np.array_equal(weights[::2], played.reordered(names).weights.astype(np.float32))


@pytest.mark.parametrize(
    "options", [{"start": 5, "end": 4}, {"handles": -1}, {"rate": -24.0}, {"rate": float("inf")}]
)
def test_nonsense_is_refused(options: dict[str, float]) -> None:
    with pytest.raises(InputError):
        DeliverOptions(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize("word", ["--start=3", "--end=3", "--handles=3", "--rate=24"])
def test_a_range_without_a_deliverable_is_refused(
    shot: Path, word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["process", str(shot), word, "-o", str(shot.with_name("none.usda"))]) == 1
    assert "--deliver FILE" in capsys.readouterr().err
    assert not shot.with_name("none.usda").exists()
