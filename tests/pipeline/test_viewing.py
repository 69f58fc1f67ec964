import json
import re
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
import pytest
from processed import Done, run
from pxr import Usd
from worlds import camera_pixels, make_world, write_live_link

from usdface.cli import main
from usdface.errors import InputError, OutputError
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.options import ViewOptions
from usdface.pipeline import export_scene, make_shot, view
from usdface.rigs import Mesh, Rig
from usdface.takes import MarkerTake


def data_of(page: Path) -> dict[str, Any]:
    found = re.search(r'id="data">(.*?)</script>', page.read_text(encoding="utf-8"))
    assert found
    return json.loads(found[1])


def test_the_page_of_a_shot_has_both_layers_and_all_that_is_known(
    done: Done, tmp_path: Path
) -> None:
    result = view(done.root, tmp_path / "shot.html")
    assert result.written == (tmp_path / "shot.html",)
    data = data_of(tmp_path / "shot.html")
    assert set(data["clips"][0]["weights"]) == {"raw", "corrected"}
    parts = ("performer", "features", "residual", "emotions", "rules", "deviations")
    assert all(data[part] for part in parts)
    assert result.summary["frames"] == len(done.world.take.times)
    assert data["character"]["shapes"] == list(done.world.rig.shape_names)


def test_the_same_shot_gives_the_same_page_and_is_not_changed(done: Done, tmp_path: Path) -> None:
    pages = [tmp_path / name for name in ("a.html", "b.html")]
    for page in pages:
        view(done.root, page)
    assert pages[0].read_bytes() == pages[1].read_bytes()


def test_a_shot_that_was_not_processed_shows_what_there_is(done: Done, tmp_path: Path) -> None:
    result = view(done.folder / "shot.usda", tmp_path / "shot.html")
    (absent,) = (f for f in result.findings if f.code == "RESULT_ABSENT")
    assert absent.message.endswith(f"its result is {done.root.name}")
    assert "RESULT_ABSENT" in json.dumps(data_of(tmp_path / "shot.html")["findings"])
    data = data_of(tmp_path / "shot.html")
    assert data["features"] is data["residual"] is data["rules"] is None
    assert data["performer"]["names"] == list(done.world.take.names)


@pytest.mark.parametrize("kept", ["layers", "flattened"])
def test_only_a_shot_without_a_result_is_called_unprocessed(
    done: Done, tmp_path: Path, kept: str
) -> None:
    """Exported, its face rests: mostly the shot was named in place of its result."""
    codes = [f.code for f in export_scene(done.folder / "shot.usda", tmp_path / "a.glb").findings]
    assert "RESULT_ABSENT" in codes
    source = done.root
    if kept == "flattened":
        source = tmp_path / "flat.usda"
        Usd.Stage.Open(str(done.root)).Flatten().Export(str(source))
    for findings in (
        export_scene(source, tmp_path / "b.glb").findings,
        view(source, tmp_path / "b.html").findings,
        view(done.folder / "rig.usda", tmp_path / "c.html").findings,
    ):
        assert "RESULT_ABSENT" not in {f.code for f in findings}


def test_any_face_has_a_page(done: Done, tmp_path: Path) -> None:
    export_scene(done.root, tmp_path / "face.glb")
    for source in (tmp_path / "face.glb", done.folder / "rig.usda"):
        result = view(source, tmp_path / "face.html")
        assert result.summary["blend_shapes"] == len(done.world.rig.shape_names)
    played = view(tmp_path / "face.glb", tmp_path / "face.html").summary["frames"]
    assert played == len(done.world.take.times)


def test_what_is_left_out_is_reported(tmp_path: Path) -> None:
    hair = Mesh("hair", [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [3], [0, 1, 2])
    rig = Rig("r", (*make_world().rig.meshes, hair))
    write_rig(rig, tmp_path / "rig.usda")
    whole = view(tmp_path / "rig.usda", tmp_path / "a.html")
    part = view(tmp_path / "rig.usda", tmp_path / "a.html", options=ViewOptions(face_only=True))
    assert (whole.summary["meshes"], part.summary["meshes"]) == (2, 1)
    assert not whole.findings
    assert [f.code for f in part.findings] == ["FEATURE_DROPPED"]


def test_a_page_is_named_as_one_and_is_no_input(done: Done, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"end its name in \.html"):
        view(done.root, tmp_path / "shot.usda")
    with pytest.raises(InputError, match="no such file"):
        view(tmp_path / "none.usda", tmp_path / "a.html")


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["view", "--help"])
    printed = capsys.readouterr().out
    assert printed.count("\n  usdface view ") == 2


def test_recorded_weights_have_a_page_without_markers(tmp_path: Path) -> None:
    world = make_world()
    folder = world.write(tmp_path)
    write_live_link(world, folder / "live.csv")
    run("take", folder / "live.csv", "-o", folder / "live.usda")
    shot = folder / "shot.usda"
    run("shot", "--rig", folder / "rig.usda", "--take", folder / "live.usda", "-o", shot)
    run("process", shot)
    result = view(folder / "shot.usdface.usda", tmp_path / "shot.html")
    data = data_of(tmp_path / "shot.html")
    assert data["performer"] is data["features"] is None
    assert result.summary["frames"] > 1


@pytest.fixture(scope="module")
def filmed_shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot of three images of 1280 x 960 pixels, black: its dots are those of the take."""
    folder = tmp_path_factory.mktemp("filmed")
    world = make_world()
    world.write(folder)
    take = camera_pixels(world.take)
    some = MarkerTake(take.names, take.times[:3], take.positions[:3], 30.0, image_size=(1280, 960))
    write_take(some, folder / "take.usda")
    bind = world.bind | {"neutral": {"start": 0, "end": 0}}
    (folder / "bind.json").write_text(json.dumps(bind))
    make_shot(
        folder / "rig.usda", folder / "take.usda", folder / "shot.usda", bind=folder / "bind.json"
    )
    for frame in range(3):
        image = oiio.ImageBuf(oiio.ImageSpec(1280, 960, 3, "uint8"))
        assert image.write(str(folder / f"face.{frame:04d}.png"))
    return folder


def report(folder: Path, name: str, confidence: object) -> Path:
    path = folder / name
    path.write_text(json.dumps({"dots": {"nose": {"confidence": confidence}}}))
    return path


@pytest.mark.slow
def test_the_page_shows_images_of_the_footage_with_labelled_dots(
    filmed_shot: Path, tmp_path: Path
) -> None:
    tracks = report(tmp_path, "take.json", [1.0, 0.5, 0.0])
    page = tmp_path / "shot.html"
    command = ["view", str(filmed_shot / "shot.usda"), "-o", str(page), "--tracks", str(tracks)]
    assert main([*command, "--footage", str(filmed_shot / "face.####.png")]) == 0
    footage = data_of(page)["footage"]
    assert [each["frame"] for each in footage["frames"]] == [0, 1, 2]
    nose = footage["names"].index("nose")
    assert [each["dots"][nose][2] for each in footage["frames"]] == [1.0, 0.5, 0.0]
    assert all(each["image"].startswith("data:image/jpeg;base64,") for each in footage["frames"])


@pytest.mark.slow
def test_what_is_no_footage_of_the_take_is_refused(
    filmed_shot: Path, done: Done, tmp_path: Path
) -> None:
    images, shot = filmed_shot / "face.####.png", filmed_shot / "shot.usda"
    short = report(tmp_path, "short.json", [1.0])
    wrong = report(tmp_path, "wrong.json", [1.0, 2.0, "x"])
    (tmp_path / "none.json").write_text("[]")
    rig, glb = filmed_shot / "rig.usda", tmp_path / "rig.glb"
    export_scene(rig, glb)
    one = tmp_path / "one.0000.png"
    one.write_bytes((filmed_shot / "face.0000.png").read_bytes())
    cases = [
        (done.root, {"footage": images}, "is no take of images"),
        (rig, {"footage": images}, "rig.usda has no take"),
        (glb, {"footage": images}, "rig.glb has no take"),
        (shot, {"tracks": short}, "give --footage"),
        (shot, {"footage": images, "tracks": short}, "is of 1 frames, the take has 3"),
        (shot, {"footage": images, "tracks": wrong}, "confidence of 'nose' is wrong"),
        (shot, {"footage": images, "tracks": tmp_path / "none.json"}, "has no dots"),
        (shot, {"footage": one}, "has 1 images; the take has a frame 1"),
    ]
    for source, options, message in cases:
        with pytest.raises(InputError, match=message):
            view(source, tmp_path / "a.html", options=ViewOptions(**options))
    assert not (tmp_path / "a.html").exists()
