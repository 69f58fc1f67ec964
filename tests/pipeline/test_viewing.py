import json
import re
from pathlib import Path
from typing import Any

import pytest
from processed import Done, run
from worlds import make_world, write_live_link

from usdface.cli import main
from usdface.errors import InputError, OutputError
from usdface.io.usd.rig_write import write_rig
from usdface.options import ViewOptions
from usdface.pipeline import export_scene, view
from usdface.rigs import Mesh, Rig


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
    view(done.folder / "shot.usda", tmp_path / "shot.html")
    data = data_of(tmp_path / "shot.html")
    assert data["features"] is data["residual"] is data["rules"] is None
    assert data["performer"]["names"] == list(done.world.take.names)


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
    said = capsys.readouterr().out
    assert said.count("\n  usdface view ") == 2


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
