"""Pins through the files: authored on the shot, kept by `process`."""

import json
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import World, animation_of, make_world, write_live_link

from usdface.cli import main
from usdface.io.usd.pins import read_pins
from usdface.schemas import tokens


def prim_with(samples: dict[str, object], shown: dict[str, str] | None = None) -> Usd.Prim:
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/R", tokens.RETARGET)
    HELD.append(stage)
    for name, values in samples.items():
        attribute = prim.CreateAttribute(tokens.PIN_PREFIX + name, Sdf.ValueTypeNames.Float)
        if isinstance(values, dict):
            for code, value in values.items():
                attribute.Set(value, code)
        else:
            attribute.Set(values)
        if shown and name in shown:
            attribute.SetDisplayName(shown[name])
    return prim


HELD: list[Usd.Stage] = []  # prims do not keep their stage
CODES = 10.0 + 2.0 * np.arange(5)
NAMES = ("jawOpen", "mouth open", "a:b", "日 本")


def test_samples_are_frames_and_a_value_is_the_whole_take() -> None:
    prim = prim_with({"jawOpen": {12.0: 0.25, 18.0: 1.0}, "a:b": 0.5})
    pins, findings = read_pins(prim, NAMES, CODES)
    found = {p.shape: (p.frames.tolist(), p.weights.tolist()) for p in pins}
    assert found == {"jawOpen": ([1, 4], [0.25, 1.0]), "a:b": ([0, 1, 2, 3, 4], [0.5] * 5)}
    assert findings == []


def test_names_that_no_attribute_may_have() -> None:
    prim = prim_with({"mouth_open": {10.0: 0.5}, "anything": {10.0: 0.5}}, {"anything": "日 本"})
    assert {p.shape for p in read_pins(prim, NAMES, CODES)[0]} == {"mouth open", "日 本"}


@pytest.mark.parametrize(("rate", "offset"), [(60.0, 0.0), (25.0, 1001.0), (48.0, 1.0 / 3.0)])
def test_blocked_samples_are_none_through_a_layer_offset(rate: float, offset: float) -> None:
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.timeCodesPerSecond = 60.0
    spec = Sdf.CreatePrimInLayer(layer, "/R")
    pin = Sdf.AttributeSpec(spec, tokens.PIN_PREFIX + "jawOpen", Sdf.ValueTypeNames.Float)
    for code in range(300):
        value = 0.25 if code % 2 == 0 else Sdf.ValueBlock()
        layer.SetTimeSample(pin.path, float(code), value)
    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(rate)
    stage.GetRootLayer().subLayerPaths.append(layer.identifier)
    stage.GetRootLayer().subLayerOffsets[0] = Sdf.LayerOffset(offset)
    codes = offset + np.arange(300) * rate / 60.0
    (found,), findings = read_pins(stage.GetPrimAtPath("/R"), NAMES, codes)
    assert found.frames.tolist() == list(range(0, 300, 2))
    assert found.weights.tolist() == [0.25] * 150
    assert findings == []


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ({"tail": {10.0: 0.5}}, "no blend shape 'tail'"),
        ({"jawOpen": {11.0: 0.5}}, "no frame at time code 11"),
        ({"jawOpen": {99.0: 0.5}}, "no frame at time code 99"),
        ({"jawOpen": {10.0: 1.5}}, "outside 0 to 1"),
        ({"jawOpen": {10.0: -0.1}}, "outside 0 to 1"),
        ({"jawOpen": {10.0: float("nan")}}, "outside 0 to 1"),
        ({"jawOpen": 2.0}, "throughout is outside 0 to 1"),
        ({"jawOpn": {10.0: 0.5}}, "no blend shape 'jawOpn'; did you mean jawOpen?"),
        ({"mouth_open": {10.0: 0.5}, "mouth open".replace(" ", "__"): {10.0: 0.5}}, "mouth__open"),
    ],
)
def test_what_fits_nothing_is_said_and_left_out(samples: dict[str, object], message: str) -> None:
    pins, findings = read_pins(prim_with(samples), NAMES, CODES)
    assert [f.code for f in findings] == ["PIN_IGNORED"] and message in findings[0].message
    assert len(pins) == len(samples) - 1


@pytest.mark.parametrize(
    ("kind", "value", "said"),
    [
        (Sdf.ValueTypeNames.String, "0.2", "'0.2'"),
        (Sdf.ValueTypeNames.FloatArray, [0.25, 0.5], "[0.25, 0.5]"),
        (Sdf.ValueTypeNames.TimeCode, 2.0, "2"),
    ],
)
def test_a_pin_of_another_type_is_no_number(
    kind: Sdf.ValueTypeName, value: object, said: str
) -> None:
    prim = prim_with({})
    prim.CreateAttribute("usdface:pin:jawOpen", kind).Set(value)
    pins, (found,) = read_pins(prim, NAMES, CODES)
    assert pins == () and found.message == f"the weight {said} throughout is no number"


def test_the_time_codes_of_all_samples_that_are_left_out_are_said() -> None:
    prim = prim_with({"jawOpen": {11.0: 0.5, 12.0: 1.0, 7200.5: 0.5}})
    (pin,), (found,) = read_pins(prim, NAMES, CODES)
    assert pin.frames.tolist() == [1]
    assert found.message == "the take has no frame at time codes 11, 7200.5"
    assert found.values["time_codes"] == [11, 7200.5]
    _, (found,) = read_pins(prim_with({"jawOpen": {10.0: 1.5, 14.0: -2, 16.0: 3}}), NAMES, CODES)
    assert found.message.endswith("at time code 10 is outside 0 to 1, as those at 14, 16")


# Through the files


def test_a_spline_is_said_to_pin_nothing(tmp_path: Path) -> None:
    path = tmp_path / "pins.usda"
    path.write_text(
        '#usda 1.0\ndef UsdFaceRetarget "R"\n{\n float usdface:pin:jawOpen = 0.5\n'
        " float usdface:pin:jawOpen.spline = {\n10: 0.2; post linear,\n"
        "18: 0.8; post linear,\n}\n}\n"
    )
    stage = Usd.Stage.Open(str(path))
    pins, findings = read_pins(stage.GetPrimAtPath("/R"), NAMES, CODES)
    assert pins == ()
    assert [f.code for f in findings] == ["PIN_IGNORED"] and "spline" in findings[0].message


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def make_shot(world: World, folder: Path) -> Path:
    world.write(folder)
    files = [str(folder / f"{name}.usda") for name in ("rig", "take", "shot")]
    made = ["--rig", files[0], "--take", files[1], "--bind", str(folder / "bind.json")]
    assert main(["shot", *made, "-o", files[2]]) == 0
    return Path(files[2])


def pin(shot: Path, samples: dict[str, dict[float, float]]) -> None:
    stage = Usd.Stage.Open(str(shot))
    prim = stage.GetPrimAtPath("/Shot/Retarget")
    for name, values in samples.items():
        attribute = prim.CreateAttribute(tokens.PIN_PREFIX + name, Sdf.ValueTypeNames.Float)
        for code, value in values.items():
            attribute.Set(value, code)
    stage.Save()


FRAME = 13


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["take", "frame"])
def test_a_pin_survives_the_solve_and_the_expressions(
    world: World, tmp_path: Path, mode: str
) -> None:
    shot = make_shot(world, tmp_path)
    root = tmp_path / "shot.usdface.usda"
    assert main(["process", str(shot), "--solve", mode]) == 0
    before = animation_of(root), animation_of(root, muted="express.usdc")
    value = float(np.float32(0.123))
    pin(shot, {"mouthSmileLeft": {float(FRAME): value}, "tail": {1.0: 0.5}})
    report = tmp_path / "report.json"
    for _ in range(2):
        assert main(["process", str(shot), "--solve", mode, "--report", str(report)]) == 0
        bytes_now = [p.read_bytes() for p in sorted((tmp_path / "shot.usdface").iterdir())]
    assert main(["process", str(shot), "--solve", mode]) == 0
    assert bytes_now == [p.read_bytes() for p in sorted((tmp_path / "shot.usdface").iterdir())]
    text = [f for f in json.loads(report.read_text())["findings"] if f["code"] == "PIN_IGNORED"]
    assert len(text) == 1 and text[0]["values"]["shape"] == "tail"
    for old, muted in zip(before, ("", "express.usdc"), strict=True):
        new = animation_of(root, muted=muted)
        curve, free = new.column("mouthSmileLeft"), old.column("mouthSmileLeft")
        assert curve[FRAME] == value and abs(free[FRAME] - value) > 0.3
        # It bends over several frames, where a frame alone would jump there and back.
        assert np.abs(np.diff(curve)).max() < 0.7 * abs(free[FRAME] - value)
        assert (np.abs(curve - free)[FRAME - 3 : FRAME + 4] > 0.05).all()
        # Bent for 0.2 s at 30 Hz, corrected within 0.2 s of that; the files' float32.
        far = np.abs(np.arange(40) - FRAME) > 12
        close = 1e-6 if muted else 1e-4
        np.testing.assert_allclose(new.weights[far], old.weights[far], atol=close)


def test_recorded_weights_can_be_pinned_too(world: World, tmp_path: Path) -> None:
    world.write(tmp_path)
    write_live_link(world, tmp_path / "phone.csv")
    take, shot = tmp_path / "phone.usda", tmp_path / "shot.usda"
    assert main(["take", str(tmp_path / "phone.csv"), "-o", str(take)]) == 0
    files = ["--rig", str(tmp_path / "rig.usda"), "--take", str(take)]
    assert main(["shot", *files, "-o", str(shot)]) == 0
    assert main(["process", str(shot), "--no-express"]) == 0
    code = float(animation_of(tmp_path / "shot.usdface.usda").times[FRAME])
    pin(shot, {"jawOpen": {code: 0.75}})
    assert main(["process", str(shot), "--no-express"]) == 0
    found = animation_of(tmp_path / "shot.usdface.usda")
    assert found.column("jawOpen")[FRAME] == 0.75
