"""Bad input: one line that says what and where, exit status 1, and nothing changed."""

import hashlib
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd
from worlds import World, make_world

from usdface.cli import main
from usdface.errors import UsdFaceError

PNG = b"\x89PNG\r\n\x1a\n" + bytes(range(256))


@dataclass(frozen=True)
class Place:
    """A folder with rig, take, binding and shot, all good until a case spoils one."""

    folder: Path
    world: World

    def __truediv__(self, name: str) -> Path:
        return self.folder / name

    def edit(self, name: str, change: Callable[[Usd.Stage], object]) -> None:
        """Change a stage and save it."""
        stage = Usd.Stage.Open(str(self / name))
        change(stage)
        stage.Save()

    def replace(self, name: str, old: str, new: str) -> None:
        """Change the text of a file."""
        text = (self / name).read_text()
        assert old in text
        (self / name).write_text(text.replace(old, new, 1))

    def bind(self, **changes: object) -> None:
        (self / "bind.json").write_text(json.dumps(self.world.bind | changes))

    @property
    def shot(self) -> list[object]:
        """The command that makes the shot anew."""
        named = ("rig", "take", "bind")
        files = [(f"--{n}", self / f"{n}.{'json' if n == 'bind' else 'usda'}") for n in named]
        return ["shot", *(x for pair in files for x in pair), "-o", self / "new.usda"]

    @property
    def process(self) -> list[object]:
        return ["process", self / "shot.usda"]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[World, dict[str, bytes]]:
    """The world's files, made once."""
    world = make_world()
    place = Place(world.write(tmp_path_factory.mktemp("made")), world)
    command = [str(a) for a in place.shot[:-1]] + [str(place / "shot.usda")]
    assert main(command) == 0
    return world, {p.name: p.read_bytes() for p in place.folder.iterdir()}


@pytest.fixture
def place(made: tuple[World, dict[str, bytes]], tmp_path: Path) -> Place:
    world, files = made
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    return Place(tmp_path, world)


@pytest.fixture
def refused(
    place: Place, capfd: pytest.CaptureFixture[str]
) -> Iterator[Callable[[Sequence[object]], str]]:
    """A function that runs a command, checks how it is refused, and returns what it said."""

    def run(arguments: Sequence[object]) -> str:
        before = listing(place.folder)
        capfd.readouterr()
        status = main([str(a) for a in arguments])
        said = capfd.readouterr()
        assert status == 1
        assert said.out == ""
        assert re.fullmatch(r"usdface: [^\n]+\n", said.err), said.err
        assert "a mistake in usdface" not in said.err
        assert listing(place.folder) == before
        return said.err.strip()

    yield run


def listing(folder: Path) -> dict[str, str]:
    """Every file and folder below, with its content."""
    return {
        str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
        if p.is_file()
        else "folder"
        for p in folder.rglob("*")
    }


Refused = Callable[[Sequence[object]], str]


# Files that are not what they should be


@pytest.mark.parametrize("command", ["rig", "take", "import", "export", "check", "process"])
@pytest.mark.parametrize("name", ["none.glb", "none.usda", "none.c3d", "none.csv", "none/none.trc"])
def test_a_missing_file(place: Place, refused: Refused, command: str, name: str) -> None:
    output = ["-o", place / ("x.glb" if command == "export" else "x.usda")]
    said = refused([command, place / name, *([] if command in ("check", "process") else output)])
    assert name in said


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("rig", "a.glb"),
        ("rig", "a.gltf"),
        ("rig", "a.usda"),
        ("rig", "a.usdc"),
        ("rig", "a.usd"),
        ("rig", "a.usdz"),
        ("rig", "a.fbx"),
        ("rig", "a.png"),
        ("take", "a.c3d"),
        ("take", "a.trc"),
        ("take", "a.csv"),
        ("take", "a.bvh"),
        ("take", "a.png"),
        ("take", "a.usda"),
        ("import", "a.glb"),
        ("import", "a.png"),
        ("export", "a.usda"),
        ("export", "a.usdc"),
        ("process", "a.usda"),
        ("process", "a.png"),
        ("check", "a.usda"),
        ("check", "a.glb"),
        ("check", "a.png"),
    ],
)
@pytest.mark.parametrize("content", [b"", b"hello world\n", PNG, b"\xff\xfe" + bytes(64)])
def test_a_file_of_another_kind(
    place: Place, refused: Refused, command: str, name: str, content: bytes
) -> None:
    (place / name).write_bytes(content)
    output = ["-o", place / ("x.glb" if command == "export" else "x.usda")]
    said = refused([command, place / name, *([] if command in ("check", "process") else output)])
    assert name in said


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", ["rig.usda", "take.usda", "shot.usda", "bind.json"])
def test_a_truncated_text(place: Place, refused: Refused, name: str, share: float) -> None:
    content = (place / name).read_bytes()
    (place / name).write_bytes(content[: int(share * len(content))])
    said = refused(place.process if name == "shot.usda" else place.shot)
    assert name in said


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", ["rig", "take"])
def test_a_truncated_crate(place: Place, refused: Refused, name: str, share: float) -> None:
    assert Sdf.Layer.FindOrOpen(str(place / f"{name}.usda")).Export(str(place / f"{name}.usdc"))
    content = (place / f"{name}.usdc").read_bytes()
    (place / f"{name}.usdc").write_bytes(content[: int(share * len(content))])
    command = [str(a).replace(f"{name}.usda", f"{name}.usdc") for a in place.shot]
    assert f"{name}.usdc" in refused(command)


def test_a_shot_that_lacks_its_rig(place: Place, refused: Refused) -> None:
    (place / "rig.usda").unlink()
    said = refused(place.process)
    assert "rig.usda" in said and "shot.usda" in said


def test_a_shot_whose_take_has_another_name_now(place: Place, refused: Refused) -> None:
    (place / "take.usda").rename(place / "take_2.usda")
    assert "take.usda" in refused(place.process)


@pytest.mark.parametrize("name", ["rig.usda", "take.usda"])
def test_a_stage_that_is_no_shot(place: Place, refused: Refused, name: str) -> None:
    said = refused(["process", place / name])
    assert name in said and "UsdFaceRetarget" in said and "usdface shot" in said


# Takes


def wide_csv(place: Place, rows: Sequence[str], names: Sequence[str] = ("a", "b")) -> Path:
    header = ",".join(["time", *(f"{n}_{axis}" for n in names for axis in "xyz")])
    (place / "take.csv").write_text("\n".join([header, *rows]) + "\n")
    return place / "take.csv"


@pytest.mark.parametrize(
    ("rows", "names", "said"),
    [
        ([], "ab", "frames"),
        (["0,,,,,,", "0.1,,,,,,"], "ab", ""),
        (["0,nan,nan,nan,nan,nan,nan"], "ab", ""),
        (["0,1,2,3,4,5,six"], "ab", "six"),
        (["0,1,2,3,4,5,6", "0,1,2,3,4,5,6"], "ab", "increas"),
        (["0,1,2,3,4,5,6"], "aa", "twice"),
    ],
)
def test_a_table_without_a_take(
    place: Place, refused: Refused, rows: list[str], names: str, said: str
) -> None:
    message = refused(["take", wide_csv(place, rows, names), "-o", place / "x.usda"])
    assert "take.csv" in message and said in message


def marker_take(place: Place, name: str, value: object, code: float | None = None) -> None:
    attribute = Sdf.Path("/Take").AppendProperty(name)

    def change(stage: Usd.Stage) -> None:
        found = stage.GetAttributeAtPath(attribute)
        found.Set(value) if code is None else found.Set(value, code)

    place.edit("take.usda", change)


@pytest.mark.parametrize("command", ["shot", "process"])
def test_a_sample_of_another_length(place: Place, refused: Refused, command: str) -> None:
    marker_take(place, "points", [(0, 0, 0)] * 7, 5)
    said = refused(getattr(place, command))
    assert "time code 5" in said and "7" in said and "23" in said and "Take>" in said


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_none(place: Place, refused: Refused, value: float) -> None:
    for code in range(40):
        marker_take(place, "points", [(value, 0, 0)] * 23, code)
    assert "finite" in refused(place.process)


def test_every_marker_hidden_in_every_frame(place: Place, refused: Refused) -> None:
    marker_take(place, "usdface:markers:visible", [False] * 23, 0)
    said = refused(place.process)
    assert "visible" in said and "take.trc" in said


def test_two_markers_of_one_name(place: Place, refused: Refused) -> None:
    names = list(place.world.take.names)
    marker_take(place, "usdface:markers:names", [names[0], *names[:-1]])
    said = refused(place.process)
    assert f"'{names[0]}'" in said and "twice" in said


def test_a_take_without_frames(place: Place, refused: Refused) -> None:
    place.edit("take.usda", lambda stage: stage.GetAttributeAtPath("/Take.points").Clear())
    assert "no time samples" in refused(place.process)


# Rigs


def test_a_rig_without_shapes(place: Place, refused: Refused) -> None:
    def strip(stage: Usd.Stage) -> None:
        for name in ("skel:blendShapes", "skel:blendShapeTargets"):
            stage.GetPrimAtPath("/Asset/Face/head").RemoveProperty(name)

    place.edit("rig.usda", strip)
    for command in (place.shot, place.process, ["rig", place / "rig.usda", "-o", place / "x.usda"]):
        said = refused(command)
        assert "no blend shapes" in said and str(place.folder) in said


def test_a_mesh_that_no_skeleton_plays(place: Place, refused: Refused) -> None:
    def unbind(stage: Usd.Stage) -> None:
        for prim in stage.Traverse():
            prim.RemoveProperty("skel:skeleton")

    place.edit("rig.usda", unbind)
    said = refused(place.process)
    assert "skel:skeleton" in said and "usdface rig" in said


def test_a_mesh_outside_the_default_prim(place: Place, refused: Refused) -> None:
    def move(stage: Usd.Stage) -> None:
        stage.SetDefaultPrim(stage.DefinePrim("/Other"))

    place.edit("rig.usda", move)
    said = refused(place.shot)
    assert "/Asset/Face/head" in said and "/Other" in said


@pytest.mark.parametrize(
    ("metric", "value"),
    [("upAxis", "X"), ("metersPerUnit", 0.0), ("metersPerUnit", -1.0), ("timeCodesPerSecond", 0.0)],
)
@pytest.mark.parametrize("name", ["rig", "take"])
def test_metrics_that_make_no_sense(
    place: Place, refused: Refused, name: str, metric: str, value: object
) -> None:
    layer = Sdf.Layer.FindOrOpen(str(place / f"{name}.usda"))
    layer.pseudoRoot.SetInfo(metric, value)
    layer.Save()
    said = refused(place.shot)
    assert metric in said and f"{name}.usda" in said


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_no_numbers(place: Place, refused: Refused, value: float) -> None:
    points = np.array(place.world.rig.meshes[0].points)
    points[7] = value
    place.edit(
        "rig.usda", lambda s: s.GetAttributeAtPath("/Asset/Face/head.points").Set(points.tolist())
    )
    assert "finite" in refused(place.shot)


def test_what_usd_warns_of_stays_off_standard_error(place: Place, refused: Refused) -> None:
    def aim(stage: Usd.Stage) -> None:
        stage.GetRelationshipAtPath("/Asset/Face/Skel.skel:animationSource").SetTargets(["/No"])

    place.edit("rig.usda", aim)
    place.bind(nose_tip="nase")
    assert "'nase'" in refused(place.shot)


# Bindings


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"marker": 3}, "'marker'"),
        ({"markers": {"nose": {"point": 195}}}, "vertices 0 to 194"),
        ({"markers": {"nose": {"point": -1}}}, "'nose'"),
        ({"markers": {"Nose": {"point": 1}, "Chin": {"point": 2}}, "nose_tip": "Nose"}, "Chin"),
        ({"mesh": "/Asset/Face/Kopf"}, "/Asset/Face/head"),
        ({"head": ["temple_l", "temple_r", "hat"]}, "'hat'"),
        ({"nose_tip": "nase"}, "'nase'"),
        ({"neutral": {"start": 0, "end": 400}}, "frames 0 to 39"),
        ({"neutral": {"start": 9, "end": 3}}, '"neutral"'),
        ({"solve": {"smoothness": -1}}, "smoothness"),
    ],
)
def test_a_binding_that_does_not_fit(
    place: Place, refused: Refused, changes: dict[str, object], said: str
) -> None:
    place.bind(**changes)
    assert said in refused(place.shot)


def test_no_binding_for_a_take_of_an_image(place: Place, refused: Refused) -> None:
    """Where the markers of a take in space sit is proposed."""
    marker_take(place, "usdface:dimension", "2d")
    command = place.shot
    del command[5:7]
    said = refused(command)
    assert "--bind" in said and "take.trc" in said


def test_too_few_markers_in_the_take(place: Place, refused: Refused) -> None:
    names = [f"m{i}" for i in range(20)] + ["nose", "chin", "brow"]
    marker_take(place, "usdface:markers:names", names)
    said = refused(place.process)
    assert "only 3" in said and "at least 4" in said


def test_the_take_lost_the_rigid_markers(place: Place, refused: Refused) -> None:
    place.bind(head=["temple_l", "temple_r", "forehead"])
    assert main([str(a) for a in [*place.shot[:-1], place / "shot.usda"]]) == 0
    names = [n.replace("temple", "ear") for n in place.world.take.names]
    marker_take(place, "usdface:markers:names", names)
    said = refused(place.process)
    assert "temple_l" in said and "take.trc" in said


@pytest.mark.parametrize("space", ["character", "take"])
def test_the_take_lost_the_nose(place: Place, refused: Refused, space: str) -> None:
    if space != "character":
        place.replace("shot.usda", 'usdface:space = "character"', f'usdface:space = "{space}"')
    names = [n.replace("nose", "snout") for n in place.world.take.names]
    marker_take(place, "usdface:markers:names", names)
    assert "'nose'" in refused(place.process)


# Shots


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (" IS raised THEN ", " IS high THEN ", "'high'"),
        (" IS raised THEN ", " THEN ", "/Shot/Fuzzy/rule_"),
        ("IF jaw_l_y", "IF corner_z_z", "corner_z_z"),
        ('usdface:head:mode = "solve"', 'usdface:head:mode = "guess"', "guess"),
        ("usdface:neutral:range = (0, 3)", "usdface:neutral:range = (30, 300)", "0 to 39"),
        ("usdface:neutral:range = (0, 3)", "usdface:neutral:range = (3, 0)", "0 to 39"),
        ("usdface:map:radius = 3", "usdface:map:radius = -3", "radius"),
        ("usdface:map:radius = 3", "usdface:map:radius = nan", "radius"),
        ("</Shot/Character/Face/head>", "</Shot/Character/Face/kopf>", "kopf"),
        ("</Shot/Capture/Take>", "</Shot/Capture/Tak>", "/Shot/Capture/Tak"),
        ("</Shot/Fuzzy>", "</Shot/Fuzz>", "/Shot/Fuzz"),
        ("rel usdface:take = </Shot/Capture/Take>", "rel usdface:take", "usdface:take"),
        ("usdface:weights = [0.9", "usdface:weights = [1.9", "/Shot/Expressions/"),
        ("usdface:weights = [0.9, ", "usdface:weights = [", "/Shot/Expressions/"),
    ],
)
def test_a_shot_with_a_broken_part(
    place: Place, refused: Refused, old: str, new: str, said: str
) -> None:
    place.replace("shot.usda", old, new)
    assert said in refused(place.process)


def test_a_character_that_is_an_instance(place: Place, refused: Refused) -> None:
    place.edit("shot.usda", lambda s: s.GetPrimAtPath("/Shot/Character").SetInstanceable(True))
    assert "instanceable = false" in refused(place.process)


# Places


@pytest.mark.parametrize("output", ["rig.usda/out.usda", "rig.usda/deep/out.usda"])
def test_a_folder_that_is_a_file(place: Place, refused: Refused, output: str) -> None:
    target = place / output
    csv = wide_csv(place, ["0,1,2,3,4,5,6"])
    for command in (
        ["rig", place / "rig.usda", "-o", target],
        ["take", csv, "-o", target],
        [*place.shot[:-1], target],
        [*place.process, "-o", target],
        [*place.process, "--gltf", target.with_suffix(".glb")],
        [*place.process, "--report", target.with_suffix(".json")],
        ["export", place / "rig.usda", "-o", target.with_suffix(".glb")],
    ):
        assert "cannot write" in refused(command)


def test_a_folder_in_the_place_of_the_file(place: Place, refused: Refused) -> None:
    (place / "out.usda").mkdir()
    for command in (["rig", place / "rig.usda"], place.process):
        assert "out.usda" in refused([*command, "-o", place / "out.usda"])


def test_the_output_is_the_input(place: Place, refused: Refused) -> None:
    for command, name in (
        (place.process, "shot.usda"),
        (["rig", place / "rig.usda"], "rig.usda"),
        (place.shot[:-2], "rig.usda"),
        (place.shot[:-2], "take.usda"),
    ):
        said = refused([*command, "-o", place / name])
        assert name in said and "overwrit" in said


@pytest.mark.parametrize("name", ["shot.usda", "rig.usda", "report", "/dev/null"])
def test_a_report_in_the_place_of_another_file(place: Place, refused: Refused, name: str) -> None:
    for command in (place.process, ["bench", "papers"]):
        assert "end its name in .json" in refused([*command, "--report", place / name])


def test_the_report_is_no_input(place: Place, refused: Refused) -> None:
    assert "overwritten" in refused([*place.shot, "--report", place / "bind.json"])


def test_a_name_that_the_system_refuses(place: Place, refused: Refused) -> None:
    name = 300 * "a"
    for command in (
        ["process", place / f"{name}.usda"],
        ["take", place / f"{name}.c3d", "-o", place / "out.usda"],
        ["rig", place / name, "-o", place / "out.usda"],
        [*place.process, "-o", place / f"{name}.usda"],
        # Fits, but for the ending that a file has while it is written.
        [*place.process, "-o", place / f"{245 * 'a'}.usda"],
    ):
        assert "File name too long" in refused(command)


@pytest.mark.parametrize("name", [".", "/", ""])
def test_a_shot_without_a_name(refused: Refused, name: str) -> None:
    assert "is no USD file" in refused(["process", name])


@pytest.mark.parametrize("name", ["out.fbx", "out", "out.glb"])
def test_an_output_of_another_kind(place: Place, refused: Refused, name: str) -> None:
    csv = wide_csv(place, ["0,1,2,3,4,5,6"])
    for command in (["rig", place / "rig.usda"], ["take", csv], place.shot[:-2], place.process):
        assert name in refused([*command, "-o", place / name])
    assert "out.txt" in refused([*place.process, "--gltf", place / "out.txt"])
    assert "out.txt" in refused(["export", place / "rig.usda", "-o", place / "out.txt"])


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_read_only_folder(place: Place, refused: Refused) -> None:
    place.folder.chmod(0o555)
    try:
        assert "read-only" in refused(place.process)
    finally:
        place.folder.chmod(0o755)


def test_a_failed_run_keeps_the_last_result(place: Place, refused: Refused) -> None:
    assert main([str(a) for a in place.process]) == 0
    marker_take(place, "points", [(0, 0, 0)] * 7, 5)
    assert "time code 5" in refused(place.process)


# How errors leave


def test_debug_raises_what_happened(place: Place) -> None:
    with pytest.raises(UsdFaceError, match=r"none\.usda"):
        main(["process", str(place / "none.usda"), "--debug"])


def test_a_mistake_of_the_program_is_one_line_too(
    place: Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("first\nsecond")

    monkeypatch.setattr("usdface.pipeline.process", broken)
    assert main([str(a) for a in place.process]) == 1
    assert capsys.readouterr().err == (
        "usdface: a mistake in usdface: ZeroDivisionError: first; --debug shows where\n"
    )
    with pytest.raises(ZeroDivisionError):
        main([*map(str, place.process), "--debug"])


def test_an_interrupted_run_says_so(
    place: Place, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    before = listing(place.folder)
    # After the first of three files was written to its temporary place.
    monkeypatch.setattr("usdface.io.usd.layers._root_layer", interrupted)
    assert main([str(a) for a in place.process]) == 1
    assert capsys.readouterr() == ("", "usdface: interrupted\n")
    assert listing(place.folder) == before


def test_no_traceback_without_it(place: Place) -> None:
    command = [sys.executable, "-m", "usdface", "process", str(place / "none.usda")]
    plain = subprocess.run(command, capture_output=True, text=True)
    assert plain.returncode == 1
    assert plain.stderr.startswith("usdface: ") and plain.stderr.count("\n") == 1
    debug = subprocess.run([*command, "--debug"], capture_output=True, text=True)
    assert debug.returncode == 1
    assert "Traceback" in debug.stderr and "none.usda" in debug.stderr
