from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest
from camera_worlds import (
    SIZE,
    make_cameras,
    moving_points,
    project_all,
    write_json,
    write_stereo_yaml,
)
from painted import layout, paint

from usdface.cli import main
from usdface.errors import InputError
from usdface.io.takes.camera_views import read_views
from usdface.io.takes.files import read_take
from usdface.io.usd.take_write import write_take
from usdface.options import TakeOptions

NAMES = tuple(f"m{n}" for n in range(8))
POINTS = moving_points(frames=30, markers=8)
OPTIONS = TakeOptions(rate=25.0, units="m")


def write_3de(path, pixels, first=1, names=NAMES):
    """Tracks (F, M, 2) of one camera, in OpenCV's pixels, as 3DEqualizer exports them."""
    lines = [str(len(names))]
    for n, name in enumerate(names):
        seen = np.flatnonzero(np.isfinite(pixels[:, n, 0]))
        lines += [name, "0", str(len(seen))]
        for f in seen:
            x, y = pixels[f, n] + 0.5
            lines.append(f"{f + first} {x:.10f} {SIZE[1] - y:.10f}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def world(tmp_path):
    def world(count=2, change=None, first=(1, 1, 1)):
        cameras = make_cameras(count)
        pixels = project_all(cameras, POINTS)
        if change is not None:
            change(pixels)
        files = [write_3de(tmp_path / f"cam{n}.txt", p, first[n]) for n, p in enumerate(pixels)]
        calibration = tmp_path / ("rig.yml" if count == 2 else "rig.json")
        calibration.write_text(write_stereo_yaml(cameras) if count == 2 else write_json(cameras))
        return files, calibration

    return world


def found(findings, code):
    return [each.values for each in findings if each.code == code]


@pytest.mark.parametrize("count", [2, 3])
def test_tracks_of_calibrated_cameras_are_markers_in_space(world, count):
    files, calibration = world(count)
    take, findings = read_views(files, calibration, OPTIONS)
    assert (take.names, take.dimension, take.rate) == (NAMES, 3, 25)
    np.testing.assert_allclose(take.positions, POINTS * [1, -1, -1], atol=1e-8)
    assert len(found(findings, "REPROJECTION_ERROR")) == count
    assert not found(findings, "VIEWS_DISAGREE")


def test_frames_belong_together_by_their_number(world):
    late = world(change=lambda pixels: pixels.__setitem__((1, slice(0, 5)), np.nan))
    take, _ = read_views(*late, OPTIONS)
    assert take.first_frame == 0
    assert not take.visible[:5].any()
    np.testing.assert_allclose(take.positions[5:], (POINTS * [1, -1, -1])[5:], atol=1e-8)


def test_cameras_that_are_out_of_step_are_told_and_put_right(world):
    files, calibration = world(first=(1, 4))
    _, findings = read_views(files, calibration, OPTIONS)
    assert found(findings, "VIEWS_OUT_OF_STEP") == [{"step_count": 3}]
    take, right = read_views(files, calibration, OPTIONS, sync=(10, 13))
    np.testing.assert_allclose(take.positions, POINTS * [1, -1, -1], atol=1e-8)
    assert take.first_frame == 0
    assert not found(right, "VIEWS_DISAGREE") and not found(right, "VIEWS_OUT_OF_STEP")
    assert len(found(findings, "VIEWS_DISAGREE")) == 2
    assert min(values["rms_px"] for values in found(findings, "VIEWS_DISAGREE")) > 3


def test_what_one_camera_alone_sees_is_occluded(world):
    files, calibration = world(change=lambda pixels: pixels.__setitem__((1, 3, 2), np.nan))
    take, findings = read_views(files, calibration, OPTIONS)
    assert np.argwhere(~take.visible).tolist() == [[3, 2]]
    assert found(findings, "VIEW_SINGLE") == [{"place_count": 1}]


def test_a_place_on_which_cameras_disagree_is_occluded(world):
    def swap(pixels):
        pixels += np.random.default_rng(0).normal(0, 0.2, pixels.shape)
        pixels[1, 7, [0, 1]] = pixels[1, 7, [1, 0]]

    take, findings = read_views(*world(change=swap), OPTIONS)
    assert np.argwhere(~take.visible).tolist() == [[7, 0], [7, 1]]
    assert found(findings, "VIEWS_DISAGREE") == [{"place_count": 2, "markers": ["m0", "m1"]}]
    for values in found(findings, "REPROJECTION_ERROR"):
        # Of four coordinates with 0.2 px the point takes three: one is left for two cameras.
        assert abs(values["rms_px"] - 0.2 / np.sqrt(2)) < 0.02


def test_tracks_on_half_the_resolution_fit_the_calibration(world, tmp_path):
    files, calibration = world()
    take, _ = read_take(files[1], TakeOptions(rate=25.0, image_size=SIZE))
    proxy = tmp_path / "proxy.csv"
    header = ["frame", *(f"{name}_{axis}" for name in take.names for axis in "xy")]
    half = take.positions.reshape(len(POINTS), -1) * np.tile([0.5, -0.5], len(NAMES))
    rows = [[f, *row] for f, row in enumerate(half.tolist())]
    proxy.write_text("\n".join(",".join(map(str, row)) for row in [header, *rows]) + "\n")
    usd = tmp_path / "proxy.usda"
    size = ["--image-size", "640", "480", "--rate", "25"]
    assert main(["take", str(proxy), "-o", str(usd), *size]) == 0
    solved, _ = read_views([files[0], usd], calibration, OPTIONS)
    np.testing.assert_allclose(solved.positions, POINTS * [1, -1, -1], atol=1e-6)


def test_a_blink_that_cameras_saw_is_their_mean(world, tmp_path):
    files, calibration = world()
    measures = np.full((2, len(POINTS)), 0.25)
    measures[0, 4], measures[1, 4], measures[0, 5], measures[:, 6] = 0.5, 1.0, np.nan, np.nan
    takes = []
    for file, blink in zip(files, measures, strict=True):
        take, _ = read_take(file, TakeOptions(rate=25.0, image_size=SIZE))
        takes.append(tmp_path / f"{file.stem}.usdc")
        write_take(replace(take, blink=blink), takes[-1])
    found, _ = read_views(takes, calibration, OPTIONS)
    np.testing.assert_allclose(found.blink[3:8], [0.25, 0.75, 0.25, np.nan, 0.25], atol=1e-6)
    assert read_views(files, calibration, OPTIONS)[0].blink is None
    late, _ = read_views(takes, calibration, OPTIONS, sync=[0, 1])
    np.testing.assert_allclose(late.blink[4:6], [0.625, 0.375], atol=1e-6)


def test_the_timecode_is_that_of_the_take_that_begins_first(world, tmp_path):
    files, calibration = world()
    takes = []
    for file, timecode in zip(files, ("", "01:00:00:00"), strict=True):
        take, _ = read_take(file, TakeOptions(rate=25.0, image_size=SIZE))
        takes.append(tmp_path / f"{file.stem}.usdc")
        write_take(replace(take, start_timecode=timecode), takes[-1])
    assert read_views(takes, calibration, OPTIONS)[0].start_timecode == "01:00:00:00"
    earlier, _ = read_views(takes, calibration, OPTIONS, sync=[0, 1])
    assert earlier.start_timecode == "01:00:00:00"
    later, findings = read_views(takes, calibration, OPTIONS, sync=[1, 0])
    assert later.start_timecode == ""
    (dropped,) = [f for f in findings if f.code == "FEATURE_DROPPED"]
    assert dropped.values["timecode"] == "01:00:00:00"
    write_take(replace(take, start_timecode="01:00:00:12"), takes[0])
    both, findings = read_views(takes, calibration, OPTIONS)
    assert both.start_timecode == "01:00:00:12"
    (dropped,) = [f for f in findings if f.code == "FEATURE_DROPPED"]
    assert dropped.values["timecode"] == "01:00:00:00" and "--sync" in dropped.message
    given = replace(OPTIONS, start_timecode="02:00:00:00")
    assert read_views(takes, calibration, given)[0].start_timecode == "02:00:00:00"


@pytest.mark.slow
def test_films_need_no_image_size_of_the_calibration(world, tmp_path):
    """They have their own, which here is none that the cameras were calibrated on."""
    image = tmp_path / "face.1.png"
    pixels = paint(layout())
    file = oiio.ImageOutput.create(str(image))
    file.open(str(image), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8"))
    file.write_image(pixels)
    file.close()
    with pytest.raises(InputError, match="280 x 220 pixels, but 'camera 1' was calibrated on"):
        read_views([image, image], world()[1], OPTIONS)


def test_takes_of_other_rates_are_named_with_their_own(world):
    files, calibration = world()
    slow = files[1].with_suffix(".usda")
    words = ["take", str(files[1]), "-o", str(slow), "--rate", "24"]
    assert main([*words, "--image-size", *map(str, SIZE)]) == 0
    with pytest.raises(InputError, match=r"have 25 and 24 frames a second"):
        read_views([files[0], slow], calibration, OPTIONS)


def test_the_command(world, tmp_path, capsys):
    files, calibration = world()
    out = tmp_path / "take.usda"
    words = ["take", *map(str, files), "--cameras", str(calibration), "-o", str(out)]
    assert main([*words, "--rate", "25", "--units", "m"]) == 0
    take, _ = read_take(out)
    np.testing.assert_allclose(take.positions, POINTS * [1, -1, -1], atol=1e-6)
    assert main(["take", *map(str, files), "-o", str(out)]) == 1
    assert "expected one take, or several with --cameras FILE" in capsys.readouterr().err
    assert main(["take", str(files[0]), "-o", str(out), "--sync", "3"]) == 1
    assert "--sync is of several cameras" in capsys.readouterr().err


def test_what_does_not_fit_is_one_clear_line(world, tmp_path):
    files, calibration = world()
    with pytest.raises(InputError, match="give one of each, up to"):
        read_views(files, calibration, OPTIONS, sync=(3,))
    with pytest.raises(InputError, match="up to 1000000000"):
        read_views(files, calibration, OPTIONS, sync=(0, 10**40))
    with pytest.raises(InputError, match="2 cameras for 1 takes"):
        read_views(files[:1], calibration, OPTIONS)
    other = write_3de(
        tmp_path / "other.txt", project_all(make_cameras(2), POINTS)[1], names=tuple("abcdefgh")
    )
    with pytest.raises(InputError, match="markers belong together by their names"):
        read_views([files[0], other], calibration, OPTIONS)
    space = tmp_path / "space.csv"
    space.write_text("frame,m0_x,m0_y,m0_z\n0,1,2,3\n")
    with pytest.raises(InputError, match="is no 2D take"):
        read_views([files[0], space], calibration, OPTIONS)
