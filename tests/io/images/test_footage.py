import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from painted import layout, paint, performance

from usdface import make_take, read_take
from usdface.arrays import FloatArray
from usdface.blend_shapes.blend_shape import BlendShape
from usdface.cli import main
from usdface.errors import InputError, OutputError
from usdface.footage.colour_channel import Pixels
from usdface.footage.tracks import Doubt
from usdface.io.images import footage as footage_module
from usdface.io.images import read_image
from usdface.io.images.film import open_film
from usdface.io.images.footage import read_footage
from usdface.io.images.image_header import ImageHeader
from usdface.io.usd.rig_write import write_rig
from usdface.options import TakeOptions
from usdface.rigs import Mesh, Rig
from usdface.takes import MarkerTake

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
COUNT = 12


def save(pixels: Pixels, path: Path) -> None:
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("FramesPerSecond", 24.0)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec), oiio.geterror()
    assert file.write_image(np.ascontiguousarray(pixels))
    file.close()


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, FloatArray]:
    folder = tmp_path_factory.mktemp("film")
    places, _ = performance(COUNT)
    for number, row in enumerate(places):
        save(paint(row, seed=number), folder / f"face.{number + 101:04d}.png")
    return folder, places


@pytest.fixture
def copied(film: tuple[Path, FloatArray], tmp_path: Path) -> Path:
    """The film's images, to be spoilt."""
    folder = tmp_path / "film"
    folder.mkdir()
    for path in film[0].iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    return folder


def codes(folder: Path, **options: object) -> tuple[MarkerTake, list[str]]:
    take, findings = read_take(folder, options=TakeOptions(rate=30.0, **options))
    assert isinstance(take, MarkerTake)
    return take, [finding.code for finding in findings]


def test_the_first_frame_of_a_film_has_the_timecode_that_is_given(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    """Images mostly have none; a program reads them in another way than `usdface take`."""
    given = TakeOptions(rate=30.0, start_timecode="02:00:00:00")
    made = make_take(film[0], tmp_path / "take.usda", options=given)
    assert made.value.start_timecode == "02:00:00:00"
    assert read_take(film[0], options=given)[0].start_timecode == "02:00:00:00"


def error(take: MarkerTake, places: FloatArray) -> FloatArray:
    """Distance (F, M) of each marker from the dot that it is at the first frame."""
    shown = np.stack([take.positions[..., 0], -take.positions[..., 1]], axis=-1)
    own = np.argmin(np.linalg.norm(shown[0][:, None] - places[0], axis=2), axis=1)
    return np.linalg.norm(shown - places[:, own], axis=2)


def test_a_film_becomes_a_take_in_pixels_y_up(film: tuple[Path, FloatArray]) -> None:
    folder, places = film
    take, found = codes(folder / "face.####.png")
    assert take.dimension == 2 and take.image_size == (280, 220) and take.rate == 30.0
    assert error(take, places).max() < 0.3
    assert found == ["DOTS_FOUND"]


def test_names_and_corrections_come_from_files(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    folder, places = film
    (tmp_path / "names.csv").write_text(
        "name,x,y\n" + "\n".join(f"m{k},{x},{y}" for k, (x, y) in enumerate(places[0]))
    )
    (tmp_path / "fixes.json").write_text(json.dumps([{"frame": 6, "name": "m3", "hidden": True}]))
    take, _ = codes(folder, names=tmp_path / "names.csv", fixes=tmp_path / "fixes.json")
    shown = take.select(tuple(f"m{k}" for k in range(20))) * (1, -1)
    assert np.nanmax(np.linalg.norm(shown - places, axis=2)) < 0.3
    assert np.argwhere(np.isnan(shown[..., 0])).tolist() == [[6, 3]]


def bound_head(places: FloatArray, folder: Path) -> None:
    """Write a flat rig that has a vertex at each place (M, 2) [px], and a binding of these.

    The rig also has an eye, and the binding names no mesh.
    """
    points = np.column_stack([places * (0.0004, -0.0004), np.zeros(len(places))])
    corners = np.array([[0, 1, 2]])
    shape = BlendShape("jawOpen", np.array([0]), np.array([[0.0, -0.01, 0.0]]))
    mesh = Mesh("head", points, [3], corners.ravel(), shapes=(shape,))
    blink = replace(shape, name="blink", offsets=0.1 * shape.offsets)
    eye = Mesh("eye", 0.1 * points, [3], corners.ravel(), shapes=(blink,))
    write_rig(Rig("flat", (eye, mesh)), folder / "rig.usda")
    markers = {f"m{k:02d}": {"point": k} for k in range(len(places))}
    (folder / "bind.json").write_text(json.dumps({"markers": markers}))


@pytest.mark.slow
def test_names_come_from_a_binding(film: tuple[Path, FloatArray], tmp_path: Path) -> None:
    folder, places = film
    bound_head(places[0], tmp_path)
    command = ["take", str(folder), "-o", str(tmp_path / "take.usda"), "--fps", "30"]
    given = ["--bind", str(tmp_path / "bind.json"), "--rig", str(tmp_path / "rig.usda")]
    assert main([*command, *given, "--report", str(tmp_path / "report.json")]) == 0
    take, _ = read_take(tmp_path / "take.usda")
    assert isinstance(take, MarkerTake)
    shown = take.select(tuple(f"m{k:02d}" for k in range(20))) * (1, -1)
    assert np.nanmax(np.linalg.norm(shown - places, axis=2)) < 0.3
    codes = [
        each["code"] for each in json.loads((tmp_path / "report.json").read_text())["findings"]
    ]
    assert "DOTS_NAMED" in codes and codes.count("MESH_ASSUMED") == 1


@pytest.mark.parametrize("alone", ["bind", "rig"])
def test_a_binding_is_given_with_its_rig(
    film: tuple[Path, FloatArray], tmp_path: Path, alone: str
) -> None:
    bound_head(film[1][0], tmp_path)
    name = {"bind": "bind.json", "rig": "rig.usda"}[alone]
    with pytest.raises(InputError, match=r"give both \(--bind, --rig\)"):
        codes(film[0], **{alone: tmp_path / name})


def test_tables_are_read_as_spreadsheets_write_them(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    folder, places = film
    x, y = places[0, 3]
    (tmp_path / "names.csv").write_text(f"name;x;y\nchin;{x};{y}\n")
    (tmp_path / "fixes.csv").write_text("frame;name;x;y;hidden\n6;chin;;;TRUE\n")
    take, _ = codes(folder, names=tmp_path / "names.csv", fixes=tmp_path / "fixes.csv")
    assert np.flatnonzero(np.isnan(take.select(("chin",))[:, 0, 0])).tolist() == [6]


@pytest.mark.slow
def test_the_report_has_no_marker_that_corrections_hide_in_all_frames(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    rows = [{"frame": k, "name": "dot_01", "hidden": True} for k in range(COUNT)]
    (tmp_path / "fixes.json").write_text(json.dumps(rows))
    options = TakeOptions(fixes=tmp_path / "fixes.json")
    result = make_take(film[0], tmp_path / "take.usda", options=options)
    assert "MARKER_NEVER_SEEN" in {found.code for found in result.findings}
    assert set(result.details["dots"]) == set(result.value.names)
    json.dumps(result.details, allow_nan=False)


def test_two_faces_in_one_image_are_reported(tmp_path: Path) -> None:
    other = np.array([520.0, 10.0]) + layout()[:12]
    both = np.concatenate([layout(), other])
    for number in range(3):
        save(paint(both, seed=number, size=(820, 220)), tmp_path / f"face.{number:04d}.png")
    _, _, findings = read_footage(tmp_path, TakeOptions(rate=30.0))
    (apart,) = [found for found in findings if found.code == "DOTS_APART"]
    assert (apart.values["dot_count"], apart.values["other_count"]) == (20, 12)


def test_the_frame_of_a_start_timecode_is_one_of_a_second(copied: Path) -> None:
    with pytest.raises(InputError, match="frame 30; expected 0 to 23, of 24 frames a second"):
        read_footage(copied, TakeOptions(rate=24.0, start_timecode="01:00:00:30"))


def test_missing_and_spoilt_images_are_occluded_and_reported(copied: Path) -> None:
    (copied / "face.0104.png").unlink()
    (copied / "face.0107.png").write_bytes(b"nonsense")
    take, found = codes(copied)
    assert np.flatnonzero(~take.visible.any(axis=1)).tolist() == [3, 6]
    assert {"FRAMES_DROPPED", "IMAGE_UNREADABLE"} <= set(found)
    assert take.visible.sum() == (COUNT - 2) * 20


def test_the_first_image_may_be_spoilt_but_not_all(copied: Path) -> None:
    (copied / "face.0101.png").write_bytes(b"")
    take, _ = codes(copied)
    assert len(take.names) == 20
    for path in copied.iterdir():
        path.write_bytes(b"")
    with pytest.raises(InputError, match="not readable"):
        codes(copied)


def test_pixels_that_are_not_square_are_announced(copied: Path) -> None:
    first, *others = sorted(copied.iterdir())
    for path in others[3:]:
        path.unlink()
    for path in (first, *others[:3]):
        image = oiio.ImageBuf(str(path))
        image.specmod().attribute("PixelAspectRatio", 1.5)
        assert image.write(str(path))
    assert "PIXELS_NOT_SQUARE" in codes(copied)[1]


@pytest.mark.slow
def test_a_later_image_does_not_say_when_the_film_begins(tmp_path: Path) -> None:
    for number, row in enumerate(performance(4)[0]):
        path = tmp_path / f"face.{number}.exr"
        linear = (paint(row) / 255.0) ** 2.2
        spec = oiio.ImageSpec(linear.shape[1], linear.shape[0], 3, "half")
        spec.attribute("smpte:TimeCode", "timecode", (0x01020300 + number, 0))
        file = oiio.ImageOutput.create(str(path))
        assert file.open(str(path), spec) and file.write_image(linear.astype(np.float32))
        file.close()
    assert codes(tmp_path)[0].start_timecode == "01:02:03:00"
    (tmp_path / "face.0.exr").write_bytes(b"")
    take, found = codes(tmp_path)
    assert take.start_timecode == "" and "FEATURE_DROPPED" in found
    assert "FEATURE_DROPPED" not in codes(tmp_path, start_timecode="01:02:03:00")[1]


@pytest.mark.slow
def test_the_first_image_of_linear_light_may_be_almost_black(tmp_path: Path) -> None:
    for number, row in enumerate(performance(6)[0]):
        path = tmp_path / f"face.{number}.exr"
        linear = (paint(row) / 255.0) ** 2.2 * (0.004 if number == 0 else 1.0)
        spec = oiio.ImageSpec(linear.shape[1], linear.shape[0], 3, "half")
        file = oiio.ImageOutput.create(str(path))
        assert file.open(str(path), spec) and file.write_image(linear.astype(np.float32))
        file.close()
    take, _ = codes(tmp_path)
    assert take.visible[1:].all() and len(take.names) == 20


def test_images_of_another_size_are_refused(copied: Path) -> None:
    save(paint(layout(), size=(300, 220)), copied / "face.0105.png")
    with pytest.raises(InputError, match=r"0105.png has 300 x 220 pixels; expected 280 x 220"):
        codes(copied)


@pytest.mark.slow
@pytest.mark.parametrize("dots", ["blue", "1000,10", "gren"])
def test_dots_of_a_colour_that_is_not_there_are_refused(
    film: tuple[Path, FloatArray], dots: str
) -> None:
    with pytest.raises(InputError):
        codes(film[0], dots=dots)


def test_what_a_file_of_dots_has_wrong_is_told_with_the_file(
    film: tuple[Path, FloatArray], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fixes, names = tmp_path / "fixes.csv", tmp_path / "names.csv"
    fixes.write_text("frame,name,hidden\n3,dot_99,true\n")
    with pytest.raises(InputError, match=r"fixes.csv: a correction is of the marker 'dot_99'"):
        read_footage(film[0], TakeOptions(fixes=str(fixes)))
    monkeypatch.setattr(footage_module, "scan", lambda *_: pytest.fail("the images were read"))
    fixes.write_text(f"frame,name,hidden\n{COUNT},dot_01,true\n")
    names.write_text("name,x,y,frame\nchin,50,50,70\n")
    for message, options in (
        (r"fixes.csv: 'dot_01' is in frame 12; the film has the frames 0 to 11", {"fixes": fixes}),
        (r"names.csv: 'chin' is in frame 70; the film has the frames", {"names": names}),
    ):
        with pytest.raises(InputError, match=message):
            read_footage(film[0], TakeOptions(**{key: str(file) for key, file in options.items()}))


def test_a_file_of_dots_may_name_any_image_of_one_file(tmp_path: Path) -> None:
    write_many(tmp_path / "face.tif", [paint(row, seed=5) for row in performance(3)[0]])
    fixes = tmp_path / "fixes.csv"
    fixes.write_text("frame,name,hidden\n2,dot_01,true\n")
    take, _ = codes(tmp_path / "face.tif", fixes=str(fixes))
    assert np.isnan(take.select(("dot_01",))[:, 0, 0]).tolist() == [False, False, True]
    fixes.write_text("frame,name,hidden\n3,dot_01,true\n")
    with pytest.raises(InputError, match="in frame 3; the film has the frames 0 to 2"):
        codes(tmp_path / "face.tif", fixes=str(fixes))


def test_images_without_dots_are_refused_in_one_line(tmp_path: Path) -> None:
    save(paint(layout()[:0]), tmp_path / "face.1.png")
    with pytest.raises(InputError, match="no dots are found"):
        codes(tmp_path)


def test_options_of_other_formats_are_refused(film: tuple[Path, FloatArray]) -> None:
    with pytest.raises(InputError, match="has no use for units"):
        codes(film[0], units="mm")
    with pytest.raises(InputError, match="has no use for dots"):
        read_take("examples/performance.trc", options=TakeOptions(dots="green"))


@pytest.mark.slow
def test_the_command_writes_take_sheet_and_report(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    folder, _ = film
    out = tmp_path / "take.usda"
    files = [
        "-o",
        str(out),
        "--sheet",
        str(tmp_path / "s.png"),
        "--report",
        str(tmp_path / "r.json"),
    ]
    assert main(["take", str(folder / "face.%04d.png"), "--fps", "30", *files]) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["written"] == [str(tmp_path / name) for name in ("take.usda", "s.png", "r.json")]
    assert len(report["dots"]) == 20 and len(report["dots"]["dot_01"]["confidence"]) == COUNT
    assert read_take(out)[0].positions.shape == (COUNT, 20, 2)


def test_the_rate_of_the_headers_is_used(tmp_path: Path) -> None:
    places, _ = performance(3)
    for number, row in enumerate(places):
        pixels = paint(row, seed=number)
        spec = oiio.ImageSpec(280, 220, 3, "half")
        spec.attribute("FramesPerSecond", 24.0)
        file = oiio.ImageOutput.create(str(tmp_path / f"a.{number}.exr"))
        assert file.open(str(tmp_path / f"a.{number}.exr"), spec)
        assert file.write_image((pixels / 255.0).astype(np.float32) ** 2.2)
        file.close()
    take, findings = read_take(tmp_path)
    assert take.rate == 24.0 and len(take.names) == 20
    assert [f.code for f in findings] == ["DOTS_FOUND"]


def test_a_gif_is_a_film(tmp_path: Path) -> None:
    places, _ = performance(4)
    path = tmp_path / "face.gif"
    specs = [oiio.ImageSpec(280, 220, 3, "uint8") for _ in places]
    file = oiio.ImageOutput.create(str(path))
    if file is None:
        pytest.skip("this OpenImageIO writes no GIF")
    assert file.open(str(path), specs)
    for number, row in enumerate(places):
        if number:
            assert file.open(str(path), specs[number], "AppendSubimage")
        file.write_image(paint(row, seed=number))
    file.close()
    take, _ = codes(path)
    assert take.positions.shape[:2] == (4, 20)


def test_images_in_one_file_are_read_from_it_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each one of a GIF needs those before it: opened anew, it took the square of their number."""
    path = tmp_path / "face.tif"
    write_many(path, [paint(row) for row in performance(6)[0]])
    film = open_film(path)
    opened: list[Path] = []
    monkeypatch.setattr(read_image, "open_file", noted(read_image.open_file, opened))
    images = [load() for load in film.loads()]
    assert len(images) == 6 and opened == [path]
    assert all(np.array_equal(image, film.frame(k)) for k, image in enumerate(images))


def noted(function: Callable[[Path], Any], calls: list[Path]) -> Callable[[Path], Any]:
    def call(path: Path) -> Any:
        calls.append(path)
        return function(path)

    return call


def test_a_film_that_the_shell_took_apart_is_told_how_to_be_named(
    film: tuple[Path, FloatArray], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="named by its pattern in quotes"):
        make_take(sorted(film[0].iterdir()), tmp_path / "take.usda")


def test_outputs_are_no_images_of_the_film(copied: Path) -> None:
    with pytest.raises(OutputError, match="would be overwritten"):
        make_take(copied / "face.####.png", copied / "t.usda", sheet=copied / "face.0101.png")
    with pytest.raises(InputError, match="of one film only"):
        make_take("examples/performance.trc", copied / "t.usda", sheet=copied / "s.png")


def test_a_movie_without_pyav_says_how_to_make_images(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "face.mp4").write_bytes(b"nonsense")
    monkeypatch.setattr("usdface.io.images.film.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"ffmpeg -i face.mp4 frames.%05d.png"):
        codes(tmp_path / "face.mp4")


@pytest.mark.slow
def test_the_dots_of_a_movie_are_looked_for_after_its_slate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "face.mp4").write_bytes(b"nonsense")
    slate = np.full((220, 280, 3), 128, dtype=np.uint8)
    frames = [slate] * 12 + [paint(layout(), seed=k) for k in range(12)]
    header = ImageHeader((280, 220), 1, 6.0)
    in_time = [(k / 6, pixels) for k, pixels in enumerate(frames)]
    monkeypatch.setattr("usdface.io.images.film.find_spec", lambda name: True)
    monkeypatch.setattr("usdface.io.images.film.read_movie_header", lambda path: header)
    monkeypatch.setattr("usdface.io.images.film.movie_frames", lambda path, size: iter(in_time))
    take, _ = codes(tmp_path / "face.mp4")
    assert len(take.names) == len(layout())
    assert np.isnan(take.positions[:12]).all()
    assert not np.isnan(take.positions[12:]).any()


@pytest.mark.slow
def test_a_photograph_of_a_face_with_21_dots() -> None:
    photograph = SHARED / "marked_photo" / "jc.jpg"
    if not photograph.exists():
        pytest.skip("needs ../shared/data/marked_photo")
    take, _ = codes(photograph)
    assert len(take.names) == 21
    assert np.abs(take.positions[0, :, 0] - 620).max() < 240


@pytest.mark.slow
def test_the_focal_length_of_the_camera_is_that_of_the_take(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(280, 220, 3, "uint8")
    spec.attribute("Exif:FocalLengthIn35mmFilm", 27)
    file = oiio.ImageOutput.create(str(tmp_path / "a.1.jpg"))
    assert file.open(str(tmp_path / "a.1.jpg"), spec)
    file.write_image(paint(layout()))
    file.close()
    assert codes(tmp_path)[0].focal_length == pytest.approx(27 / 36 * 280)
    assert codes(tmp_path, focal_length=300.0)[0].focal_length == 300.0


def test_the_summary_has_the_focal_length_of_the_take_or_none(tmp_path: Path) -> None:
    save(paint(layout()), tmp_path / "a.1.png")
    for focal in (None, 300.0):
        options = TakeOptions(focal_length=focal)
        made = make_take(tmp_path, tmp_path / "t.usdc", options=options)
        assert made.summary["focal_px"] == focal


def write_many(path: Path, images: list[Pixels]) -> None:
    """Write several images into one file."""
    height, width, _ = images[0].shape
    specs = [oiio.ImageSpec(width, height, 3, "uint8") for _ in images]
    if path.suffix == ".exr":
        specs = [oiio.ImageSpec(width, height, 3, "half") for _ in images]
        for number, spec in enumerate(specs):
            spec.attribute("oiio:subimagename", f"view{number}")
    file = oiio.ImageOutput.create(str(path))
    if path.suffix == ".exr":
        assert file.open(str(path), specs)
    else:
        assert file.open(str(path), specs[0])
    for number, image in enumerate(images):
        if number:
            assert file.open(str(path), specs[number], "AppendSubimage")
        pixels = image if path.suffix != ".exr" else (image / 255.0).astype(np.float32) ** 2.2
        assert file.write_image(pixels)
    file.close()


def test_parts_of_an_image_are_no_film_and_announced(tmp_path: Path) -> None:
    places, _ = performance(3)
    write_many(tmp_path / "face.exr", [paint(row, seed=5) for row in places])
    take, findings = read_take(tmp_path / "face.exr")
    assert len(take.times) == 1
    (found,) = [f for f in findings if f.code == "FEATURE_DROPPED"]
    assert found.values["part_count"] == 2


@pytest.mark.slow
def test_pages_are_a_film_which_is_said(tmp_path: Path) -> None:
    places, _ = performance(4)
    write_many(tmp_path / "face.tif", [paint(row, seed=5) for row in places])
    take, findings = read_take(tmp_path / "face.tif")
    assert len(take.times) == 4
    assert [f.values["image_count"] for f in findings if "image_count" in f.values] == [4]


def test_many_doubts_are_some_findings(film: tuple[Path, FloatArray]) -> None:
    opened = open_film(film[0])
    _, footage, _ = read_footage(film[0], TakeOptions())
    tracks = replace(footage.tracks, doubts=tuple(Doubt(k % 20, k, k) for k in range(400)))
    opened.unreadable.update({k: "spoilt" for k in range(50)})
    found = [f.code for f in footage_module._found(opened, footage.model, tracks, "")]
    assert found.count("TRACK_DOUBTED") == found.count("IMAGE_UNREADABLE") == 21
