"""Takes survive USD, in any units, up axis, rate and place."""

from pathlib import Path

import numpy as np
import pytest
from marker_takes import NAMES, marker_take
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from usdface.errors import InputError
from usdface.io.usd.take import read_take_prim
from usdface.io.usd.take_write import write_take
from usdface.schemas import tokens
from usdface.takes import MarkerTake, WeightsTake

RNG = np.random.default_rng(3)


def round_trip(take: MarkerTake | WeightsTake, folder: Path) -> MarkerTake | WeightsTake:
    write_take(take, folder / "take.usdc")
    stage = Usd.Stage.Open(str(folder / "take.usdc"))
    return read_take_prim(stage.GetDefaultPrim())[0]


@pytest.mark.parametrize("unit", [1.0, 0.01, 0.001])
@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("rate", [24.0, 30000 / 1001, 60.0, 120.0])
def test_a_take_survives_any_units_up_axis_and_rate(
    tmp_path: Path, unit: float, up_axis: str, rate: float
) -> None:
    take = marker_take(
        meters_per_unit=unit, up_axis=up_axis, rate=rate, start_timecode="01:02:03:04"
    )
    take = MarkerTake(
        take.names, np.arange(12) / rate, take.positions, rate, unit, up_axis, "01:02:03:04"
    )
    back = round_trip(take, tmp_path)
    assert isinstance(back, MarkerTake)
    assert (back.names, back.rate, back.start_timecode) == (NAMES, rate, "01:02:03:04")
    assert (back.meters_per_unit, back.up_axis) == (unit, up_axis)
    np.testing.assert_allclose(back.times, take.times, atol=1e-9)
    np.testing.assert_allclose(back.positions, take.positions, atol=1e-7)


def test_what_a_recorder_saw_of_the_eyes_survives(tmp_path: Path) -> None:
    blink, gaze = RNG.random(12), RNG.uniform(-1.0, 1.0, (12, 2))
    blink[4] = gaze[4] = np.nan
    back = round_trip(marker_take(blink=blink, gaze=gaze), tmp_path)
    assert isinstance(back, MarkerTake)
    np.testing.assert_allclose(back.blink, blink, atol=1e-6)
    np.testing.assert_allclose(back.gaze, gaze, atol=1e-6)
    np.testing.assert_array_equal(back.with_frames(slice(3, 6)).gaze, back.gaze[3:6])
    nothing = round_trip(marker_take(), tmp_path)
    assert isinstance(nothing, MarkerTake) and nothing.gaze is None


@pytest.mark.parametrize("gaze", [np.zeros(12), np.zeros((11, 2)), np.full((12, 2), 4.0)])
def test_a_gaze_is_two_angles_of_each_frame(gaze: np.ndarray) -> None:
    with pytest.raises(InputError, match="gaze"):
        marker_take(gaze=gaze)


def test_uneven_times_survive(tmp_path: Path) -> None:
    times = np.cumsum(RNG.uniform(0.01, 0.1, 12))
    times -= times[0]
    take = MarkerTake(NAMES, times, marker_take().positions)
    np.testing.assert_allclose(round_trip(take, tmp_path).times, times, atol=1e-9)


def test_pixels_stay_pixels(tmp_path: Path) -> None:
    diameters = np.linspace(8.0, 12.0, len(NAMES))
    take = marker_take(
        2, image_size=(1920, 1080), focal_length=1400.0, first_frame=40, diameters=diameters,
        deviation=0.12,
    )  # fmt: skip
    back = round_trip(take, tmp_path)
    assert isinstance(back, MarkerTake)
    assert back.dimension == 2 and back.image_size == (1920, 1080)
    assert back.focal_length == 1400.0
    assert back.first_frame == 40
    assert back.deviation == 0.12
    np.testing.assert_array_equal(back.diameters, diameters)
    np.testing.assert_allclose(back.positions, take.positions, rtol=1e-6)


def test_recorded_blinks_stay(tmp_path: Path) -> None:
    blink = np.array([np.nan, *np.linspace(0.0, 1.0, 11)])
    back = round_trip(marker_take(2, blink=blink), tmp_path)
    assert isinstance(back, MarkerTake)
    np.testing.assert_allclose(back.blink, blink, atol=1e-7)


def test_sizes_of_markers_in_space_are_in_the_unit_of_the_stage(tmp_path: Path) -> None:
    diameters = np.array([0.004, np.nan, *[0.003] * (len(NAMES) - 2)])
    take = marker_take(meters_per_unit=0.001, diameters=diameters, deviation=0.0002)
    back = round_trip(take, tmp_path)
    stage = Usd.Stage.Open(str(next(tmp_path.glob("*.usd*"))))
    written = stage.GetDefaultPrim().GetAttribute("usdface:markers:diameters").Get()
    assert written[0] == pytest.approx(4.0)
    assert isinstance(back, MarkerTake)
    np.testing.assert_allclose(back.diameters, diameters)
    assert back.deviation == pytest.approx(0.0002)


@pytest.mark.parametrize(("rate", "offset"), [(25.0, 1001.0), (29.97, 100.0), (48.0, 1.0 / 3.0)])
def test_occlusion_is_the_same_through_a_layer_offset(
    tmp_path: Path, rate: float, offset: float
) -> None:
    frames = np.arange(300)
    positions = np.zeros((len(frames), 1, 3))
    positions[frames % 2 == 1] = np.nan
    take = MarkerTake(("chin",), frames / 60.0, positions, rate=60.0)
    write_take(take, tmp_path / "take.usdc")
    shot = Usd.Stage.CreateInMemory()
    shot.SetTimeCodesPerSecond(rate)
    path = str(tmp_path / "take.usdc")
    prim = shot.DefinePrim("/Take")
    prim.GetReferences().AddReference(path, "/Take", Sdf.LayerOffset(offset))
    back, codes = read_take_prim(prim)
    assert isinstance(back, MarkerTake)
    assert codes[0] == offset
    assert np.array_equal(back.visible, take.visible)


def test_the_prims_own_transform_counts(tmp_path: Path) -> None:
    take = marker_take(meters_per_unit=0.01)
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    parent = UsdGeom.Xform.Define(stage, "/Capture")
    parent.AddTransformOp().Set(
        Gf.Matrix4d().SetScale(0.01) * Gf.Matrix4d().SetTranslate((1, 2, 3))
    )
    prim = stage.DefinePrim("/Capture/Take")
    prim.GetReferences().AddReference(str(tmp_path / "take.usda"))
    back, codes = read_take_prim(prim)
    assert isinstance(back, MarkerTake)
    expected = take.positions + np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(back.positions, expected, atol=1e-6)
    # The stage runs at 24: USD rescales the 60 of the take.
    np.testing.assert_allclose(codes, np.arange(12) * 24 / 60)
    np.testing.assert_allclose(back.times, take.times, atol=1e-9)


@pytest.mark.parametrize("codes", [[3.0], [0.0, 11.0]])
def test_a_transform_that_has_samples_counts_as_well(tmp_path: Path, codes: list[float]) -> None:
    # One sample: as several programs write what stands still. Two: a capture volume that moves.
    take = marker_take()
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(60)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    move = UsdGeom.Xform.Define(stage, "/Capture").AddTranslateOp()
    for code in codes:
        move.Set(Gf.Vec3d(1 + code, 2, 3), code)
    prim = stage.DefinePrim("/Capture/Take")
    prim.GetReferences().AddReference(str(tmp_path / "take.usda"))
    along = np.interp(np.arange(12), codes, codes)
    places = np.stack([1 + along, np.full(12, 2), np.full(12, 3)], axis=1)
    back, _ = read_take_prim(prim)
    assert isinstance(back, MarkerTake)
    np.testing.assert_allclose(back.positions, take.positions + places[:, None], atol=1e-5)
    some, _ = read_take_prim(prim, np.array([2, 7]))
    assert isinstance(some, MarkerTake)
    np.testing.assert_array_equal(some.positions, back.positions[[2, 7]])


def test_a_weights_take_is_a_skel_animation(tmp_path: Path) -> None:
    weights = RNG.uniform(size=(5, 2)).astype(np.float32)
    take = WeightsTake(("jawOpen", "Ünï code"), np.arange(5) / 30, weights, 30.0, "00:00:01:00")
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert stage.GetDefaultPrim().IsA(UsdSkel.Animation)
    back, _ = read_take_prim(stage.GetDefaultPrim())
    assert isinstance(back, WeightsTake)
    assert back.names == take.names and back.start_timecode == "00:00:01:00"
    np.testing.assert_array_equal(back.weights, take.weights)
    assert back.head is None


def test_a_recorded_head_is_kept_beside_the_weights(tmp_path: Path) -> None:
    head = 0.8 * RNG.normal(size=(5, 3))
    take = WeightsTake(("jawOpen",), np.arange(5) / 30, np.zeros((5, 1)), 30.0, head=head)
    write_take(take, tmp_path / "take.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    prim = stage.GetDefaultPrim()
    back, _ = read_take_prim(prim)
    assert isinstance(back, WeightsTake) and back.head is not None
    np.testing.assert_allclose(back.head, head, atol=1e-6)
    some, _ = read_take_prim(prim, np.array([1, 3]))
    assert isinstance(some, WeightsTake) and some.head is not None
    np.testing.assert_array_equal(some.head, back.head[[1, 3]])
    assert some.reordered(("a", "jawOpen")).head is some.head
    prim.GetAttribute(tokens.HEAD_ROTATION).Set(Gf.Quatf(0.0), 2.0)
    with pytest.raises(InputError, match="must be quaternions of a length above 0"):
        read_take_prim(prim)


@pytest.mark.parametrize("broken", ["short", "nan", "none", "visible", "names"])
def test_arrays_that_do_not_fit_are_named(tmp_path: Path, broken: str) -> None:
    write_take(marker_take(), tmp_path / "take.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    prim = stage.GetDefaultPrim()
    points = prim.GetAttribute("points")
    if broken == "short":
        points.Set(Vt.Vec3fArray(2), 5)
    elif broken == "nan":
        points.Set(Vt.Vec3fArray([Gf.Vec3f(float("nan"))] * 3), 5)
    elif broken == "none":
        points.Clear()
    elif broken == "visible":
        prim.GetAttribute(tokens.MARKERS_VISIBLE).Set(Vt.BoolArray([True]), 5)
    else:
        prim.GetAttribute(tokens.MARKERS_NAMES).Clear()
    with pytest.raises(InputError, match="/Take") as caught:
        read_take_prim(prim)
    assert "\n" not in str(caught.value)
