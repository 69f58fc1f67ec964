"""Places that nothing can be written to."""

import os
import re
from pathlib import Path

import pytest
from pxr import Usd
from spoilt import Place, Refused, marker_take, wide_csv

from usdface.cli import main


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
        message = refused([*command, "-o", place / name])
        assert name in message and "overwrit" in message


@pytest.mark.parametrize("name", ["rig.usda", "take.usda"])
def test_a_fuzzy_system_in_the_place_of_what_the_shot_is_made_of(
    place: Place, refused: Refused, name: str
) -> None:
    """The files that a shot references are inputs, too, and the takes that labels name."""
    (place / "labels.csv").write_text("take,start_frame,end_frame,emotion\ntake.usda,9,12,joy\n")
    bound = ["--rig", place / "rig.usda", "--bind", place / "bind.json"]
    commands = [["convert", place / "shot.usda"], ["fit", "--shot", place / "shot.usda"]]
    if name == "take.usda":
        commands.append(["fit", *bound, "--labels", place / "labels.csv"])
    for command in commands:
        message = refused(["fuzzy", *command, "-o", place / name])
        assert name in message and "overwritten" in message


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
        ["rig", place / name, "-o", place / "out.usda", "--report", place / "out.json"],
        [*place.process, "-o", place / f"{name}.usda"],
    ):
        assert re.search(r"File name too long.* \[[A-Z_]+\]$", refused(command))
    # Files have short names while they are written.
    assert main([*map(str, place.process), "-o", str(place / f"{245 * 'a'}.usda")]) == 0


def test_a_name_that_is_not_utf_8(place: Place, refused: Refused) -> None:
    """USD writes such a file, and then cannot open it."""
    name = os.fsdecode(b"\xff.usda")
    for command in (place.shot[:-1], [*place.process, "-o"]):
        message = refused([*command, place / name])
        assert "\\udcff.usda: the name is not UTF-8, as USD wants it" in message
    csv = wide_csv(place, ["0,1,2,3,4,5,6", "0.1,1,2,3,4,5,6"])
    assert "is not UTF-8" in refused(["take", csv, "-o", place / os.fsdecode(b"\xff") / "a.usda"])


@pytest.mark.parametrize(
    ("part", "says"),
    [
        ("back\\slash", "with a backslash; rename 'back"),
        ("tab\there", "with a control character; rename 'tab"),
        ("a:SDF_FORMAT_ARGS:b", "with ':SDF_FORMAT_ARGS:'; rename 'a:SDF"),
    ],
)
def test_a_path_that_usd_cannot_follow(
    place: Place, refused: Refused, part: str, says: str
) -> None:
    """USD writes such a shot, and then does not find the rig that it names."""
    assert says in refused([*place.shot[:-1], place / f"{part}.usda"])
    assert says in refused([*place.process, "-o", place / f"{part}.usda"])
    folder = place / part
    folder.mkdir()
    assert says in refused([*place.shot[:-1], folder / "new.usda"])
    (folder / "rig.usda").write_bytes((place / "rig.usda").read_bytes())
    elsewhere = [folder / "rig.usda" if a == place / "rig.usda" else a for a in place.shot[:-1]]
    refusal = refused([*elsewhere, place / "new.usda"])
    assert says in refusal or "cannot be read as USD" in refusal


def test_a_shot_in_a_folder_that_was_renamed(place: Place, refused: Refused) -> None:
    folder = place / "back\\slash"
    folder.mkdir()
    for name in ("rig.usda", "take.usda", "shot.usda"):
        (place / name).rename(folder / name)
    message = refused(["process", folder / "shot.usda"])
    assert "does not compose: USD follows no path with a backslash" in message


def test_paths_of_all_other_characters(place: Place) -> None:
    folder = place / "a@b@@@ #%20%d[0].usd] 'q\"~$`{}<UDIM>?*:;&=+,! üñ口 "
    folder.mkdir()
    for name in ("rig.usda", "take.usda", "bind.json"):
        (place / name).rename(folder / name)
    moved = [folder / a.name if isinstance(a, Path) else a for a in place.shot[:-1]]
    shot = folder / "x@#.usda"
    assert main([*map(str, moved), str(shot)]) == 0
    assert main(["process", str(shot), "--gltf", str(folder / "a.glb")]) == 0
    assert Usd.Stage.Open(str(folder / "x@#.usdface.usda")).GetCompositionErrors() == []


@pytest.mark.parametrize("name", [".", "/", ""])
def test_a_shot_without_a_name(refused: Refused, name: str) -> None:
    assert "is no USD file" in refused(["process", name])


@pytest.mark.slow
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
