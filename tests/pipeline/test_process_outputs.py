"""Outputs of `process` are refused before the solve, and replace those of an earlier run."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from processed import shoot
from pxr import Sdf, Usd
from worlds import make_world

from usdface.cli import main
from usdface.pipeline import process, processing


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    return shoot(make_world().write(tmp_path))


@pytest.fixture
def refused(
    shot: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Return what `process` says before it solves anything or changes any file."""

    def solve(*_: Any, **__: Any) -> None:
        pytest.fail("the shot was solved")

    def run(*options: str) -> str:
        before = {path: path.read_bytes() for path in shot.parent.rglob("*") if path.is_file()}
        with monkeypatch.context() as patched:
            patched.chdir(shot.parent)
            patched.setattr(processing, "retarget_run", solve)
            assert main(["process", "shot.usda", *options]) == 1
        after = {path: path.read_bytes() for path in shot.parent.rglob("*") if path.is_file()}
        assert after == before
        return capfd.readouterr().err

    return run


HAND = """#usda 1.0
(subLayers = [@./shot.usda@])
over "Shot" { over "Fuzzy" { double usdface:gain = 0.5 } }
"""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("-o", "hand.usda"), "hand.usda is of another origin, not a result of `process` that"),
        (("-o", "rig.usda", "--no-head"), "rig.usda is read by"),
        (("-o", "other.usda"), "other.usda is a take, not a result"),
        (("--deliver", "hand.usda"), "hand.usda is of another origin, not a deliverable that"),
        (("--deliver", "other.usda"), "other.usda is a take, not a deliverable;"),
        (("--gltf", "hand.glb"), "hand.glb is of another origin, not a glTF file that"),
        (("--report", "bind.json"), "bind.json is a binding, not a report;"),
        (("--gltf", "face.fbx"), "a glTF file ends in .glb or .gltf"),
        (("--deliver", "face.fbx"), "end it in .usda, .usdc or .usd"),
        (("--figure", "face.fbx"), "end it in .png, .svg, .pdf"),
        (("--sheet", "face.xyz"), "end it in .png, .svg, .pdf"),
    ],
)
def test_before_the_solve(
    shot: Path, refused: Callable[..., str], options: tuple[str, ...], message: str
) -> None:
    (shot.parent / "hand.usda").write_text(HAND)
    (shot.parent / "hand.glb").write_bytes(b"glTF")
    (shot.parent / "other.usda").write_bytes((shot.parent / "take.usda").read_bytes())
    assert message in refused(*options)


def test_the_results_of_an_earlier_run_are_replaced(shot: Path) -> None:
    report, folder = shot.parent / "report.json", shot.parent
    command = ["process", shot, "--deliver", folder / "face.usda", "--gltf", folder / "face.glb"]
    words = [str(word) for word in (*command, "--report", report)]
    assert main(words) == 0
    stage = Usd.Stage.Open(str(shot))
    stage.GetPrimAtPath("/Shot/Fuzzy").GetAttribute("usdface:gain").Set(0.6)
    stage.Save()
    first = (folder / "face.usda").read_bytes()
    assert main(words) == 0
    assert (folder / "face.usda").read_bytes() != first
    assert len(json.loads(report.read_text())["written"]) > 3
    for _ in range(2):  # the root layer stays as it is, and nobody minds
        process(shot, in_place=True)


def test_a_result_is_not_solved_again_beside_itself(
    shot: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A slip: the name of the result for that of its shot."""
    process(shot)
    before = sorted(shot.parent.rglob("*"))
    assert main(["process", str(shot.with_name("shot.usdface.usda"))]) == 1
    assert "is a result of `usdface process`; process the shot that it" in capfd.readouterr().err
    assert sorted(shot.parent.rglob("*")) == before
    over = shot.with_name("over.usda")
    over.write_text("#usda 1.0\n(\n subLayers = [@./shot.usdface.usda@]\n)\n")
    assert main(["process", str(over)]) == 0  # a layer over a result is a shot of its own


@pytest.mark.parametrize("name", ["shot.usdface.usda", "face.usda"])
def test_a_result_that_a_person_edited_is_kept(
    shot: Path, refused: Callable[..., str], name: str
) -> None:
    process(shot, deliver=shot.with_name("face.usda"))
    layer = Sdf.Layer.FindOrOpen(str(shot.with_name(name)))
    layer.documentation = "pins of the animator"
    layer.Save()
    message = refused("--deliver", "face.usda")
    assert (
        f"{name} was edited since usdface wrote it; overwrite (--overwrite) replaces it" in message
    )
    process(shot, deliver=shot.with_name("face.usda"), overwrite=True)
    assert "animator" not in shot.with_name(name).read_text()


def brighten(path: Path) -> Sdf.Layer:
    """Change one weight of one frame by a thousandth."""
    layer = Sdf.Layer.FindOrOpen(str(path))
    places: list[Sdf.Path] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, places.append)
    (place,) = [p for p in places if p.name == "blendShapeWeights"]
    code = layer.ListTimeSamplesForPath(place)[2]
    weights = layer.QueryTimeSample(place, code)
    weights[1] += 0.001
    layer.SetTimeSample(place, code, weights)
    return layer


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("solve.usdc", ()),
        ("express.usdc", ()),
        ("express.usdc", ("--no-express",)),
        pytest.param("solve.usdc", ("--in-place",), marks=pytest.mark.slow),
        pytest.param("solve.usdc", ("--no-express",), marks=pytest.mark.slow),
        pytest.param("express.usdc", ("--in-place",), marks=pytest.mark.slow),
    ],
)
def test_a_layer_that_a_person_edited_is_kept(
    shot: Path, refused: Callable[..., str], name: str, options: tuple[str, ...]
) -> None:
    """Also one that this run would remove."""
    in_place = options == ("--in-place",)
    process(shot, in_place=in_place)
    path = shot.with_name("shot.usdface") / name
    before = path.read_bytes()
    process(shot, in_place=in_place)
    assert path.read_bytes() == before  # nobody edited it
    layer = brighten(path)
    assert f"{name} was edited since usdface wrote it; " in refused(*options)  # though not saved
    layer.Save()
    message = refused(*options)
    assert "overwrite (--overwrite) replaces it; edits belong in a layer of your own" in message
    process(shot, in_place=in_place, overwrite=True)
    assert path.read_bytes() == before


def test_layers_of_an_older_version_are_replaced_and_others_kept(
    shot: Path, refused: Callable[..., str]
) -> None:
    process(shot)
    path = shot.with_name("shot.usdface") / "solve.usdc"
    before = path.read_bytes()
    layer = brighten(path)
    mine = layer.customLayerData["usdface"]
    layer.customLayerData = {"usdface": {"generation": mine["generation"]}}
    layer.Save()
    process(shot)
    assert path.read_bytes() == before
    layer.customLayerData = {}  # as a program that writes a file of its own leaves it
    layer.Save()
    assert "solve.usdc is of another origin, not a layer of a result" in refused()


@pytest.mark.parametrize("edited", [False, True])
def test_a_root_layer_of_an_older_version(
    shot: Path, refused: Callable[..., str], edited: bool
) -> None:
    root = process(shot).written[0]
    layer = Sdf.Layer.FindOrOpen(str(root))
    mine = layer.customLayerData["usdface"]
    layer.customLayerData = {"usdface": {"generation": mine["generation"]}}
    if edited:
        Sdf.CreatePrimInLayer(layer, "/Shot").specifier = Sdf.SpecifierOver
    layer.Save()
    if edited:
        message = refused()
        assert f"{root.name} may hold edits; an older version wrote it; overwrite" in message
    process(shot, overwrite=edited)
    assert "fingerprint" in root.read_text()


def test_pieces_are_not_solved_for_a_file_that_is_kept(
    shot: Path, refused: Callable[..., str]
) -> None:
    (shot.parent / "hand.usda").write_text(HAND)
    assert "another origin" in refused("-o", "hand.usda", "--pieces", "pieces")
    assert not (shot.parent / "pieces").exists()
    assert "there is no emotion 'jy'" in refused("--gains", "jy=1", "--pieces", "pieces")
