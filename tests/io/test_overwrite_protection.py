"""An output replaces what usdface wrote as the same kind, and nothing else unless told to."""

import json
from pathlib import Path

import pytest
from worlds import make_world

from usdface.cli import main
from usdface.errors import OutputError
from usdface.io.overwrite_protection import OutputKind, check_replaced
from usdface.pipeline import calibrate, export_scene, make_markers, make_rig, make_shot, make_take


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_world().write(tmp_path)


def shoot(folder: Path, name: str = "shot.usda", **options: object) -> Path:
    make_shot(folder / "rig.usda", folder / "take.usda", folder / name, **options)  # type: ignore[arg-type]
    return folder / name


def refusal(place: Path, kind: OutputKind, overwrite: bool | None = False) -> str:
    with pytest.raises(OutputError) as caught:
        check_replaced([(place, kind)], overwrite)
    assert caught.value.code == "OUTPUT_UNWRITABLE"
    return str(caught.value).removeprefix(f"{place} ")


def test_the_line_says_what_is_there_and_the_way_out(folder: Path) -> None:
    (folder / "notes.usda").write_text("#usda 1.0\n")
    way = "; overwrite (--overwrite) replaces it, another name keeps it"
    assert refusal(folder / "take.usda", "shot") == f"is a take, not a shot{way}"
    assert refusal(folder / "rig.usda", "take") == f"is a rig, not a take{way}"
    assert refusal(folder / "bind.json", "report") == f"is a binding, not a report{way}"
    assert refusal(folder / "bind.json", "binding") == f"may hold places set by hand{way}"
    other = "is of another origin, not a result of `process` that usdface wrote"
    assert refusal(folder / "notes.usda", "result") == f"{other}{way}"
    assert refusal(folder / "notes.usda", "result", None) == f"{other}; choose another name"


def test_nothing_is_lost_with_no_file_an_empty_one_or_by_wish(folder: Path) -> None:
    (folder / "empty.usda").write_text("")
    check_replaced([(None, "shot"), (folder / "no.usda", "shot"), (folder / "empty.usda", "shot")])
    check_replaced([(folder / "take.usda", "shot")], overwrite=True)


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "7",
        '{"name": "x"}',
        "[1]",
        '{"markers": 7}',
        '{"shapes": {}}',
        "[" * 100_000,
        "\udcff",
    ],
)
def test_other_json_is_of_another_origin(tmp_path: Path, text: str) -> None:
    place = tmp_path / "a.json"
    place.write_bytes(text.encode(errors="surrogateescape"))
    for kind in ("binding", "calibration", "report"):
        assert "another origin" in refusal(place, kind)  # type: ignore[arg-type]


def test_an_empty_list_is_a_report(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("[]")
    check_replaced([(tmp_path / "a.json", "report")])
    assert refusal(tmp_path / "a.json", "binding").startswith("is a report, not a binding")


def test_json_that_is_too_large_is_not_looked_into(tmp_path: Path) -> None:
    with (tmp_path / "a.json").open("wb") as file:
        file.truncate(2**28 + 1)
    assert refusal(tmp_path / "a.json", "report").startswith("is too large to look into; ")


def test_a_binding_that_a_person_edited_is_kept(folder: Path) -> None:
    made = folder / "made.json"
    for _ in range(2):
        shoot(folder, bind=folder / "bind.json", write_bind=made)
    made.write_text(json.dumps(json.loads(made.read_text()), sort_keys=True))  # no edit
    shoot(folder, bind=folder / "bind.json", write_bind=made)
    edited = json.loads(made.read_text())
    edited["markers"]["chin"]["point"] += 1
    made.write_text(json.dumps(edited))
    before = made.read_text(), (folder / "shot.usda").stat().st_mtime_ns
    with pytest.raises(OutputError, match=r"made\.json was edited since usdface wrote it"):
        shoot(folder, bind=folder / "bind.json", write_bind=made)
    assert (made.read_text(), (folder / "shot.usda").stat().st_mtime_ns) == before
    with pytest.raises(OutputError, match="was edited"):
        make_markers(folder / "rig.usda", output=made)
    shoot(folder, "edited.usda", bind=made)  # it is read as before
    shoot(folder, bind=folder / "bind.json", write_bind=made, overwrite=True)
    assert json.loads(made.read_text()) != edited


def test_a_calibration_that_a_person_edited_is_kept(folder: Path) -> None:
    shot, who = shoot(folder, bind=folder / "bind.json"), folder / "who.json"
    for _ in range(2):
        calibrate(shot, who)
    edited = json.loads(who.read_text())
    name = next(iter(edited["shapes"]))
    edited["shapes"][name]["gain"] = 1.25
    who.write_text(json.dumps(edited))
    with pytest.raises(OutputError, match=r"who\.json was edited since usdface wrote it"):
        calibrate(shot, who)
    shoot(folder, "edited.usda", bind=folder / "bind.json", calibration=who)  # read as before
    del edited["fingerprint"]  # as an older version wrote it
    who.write_text(json.dumps(edited))
    assert refusal(who, "calibration").startswith("may hold values set by hand; ")
    calibrate(shot, who, overwrite=True)
    assert json.loads(who.read_text()) != edited
    calibrate(shot, who)


def test_what_a_link_leads_to_is_looked_at_and_stays(folder: Path) -> None:
    edited, link = shoot(folder, "kept.usda", bind=folder / "bind.json"), folder / "link.usda"
    link.symlink_to(edited.name)
    before = edited.read_bytes()
    shoot(folder, "link.usda", bind=folder / "bind.json")
    assert not link.is_symlink() and edited.read_bytes() == before
    link.unlink()
    link.symlink_to(edited.name)
    edited.write_bytes(before + b'\nover "Mine" {}\n')
    assert refusal(link, "shot").startswith("was edited since usdface wrote it; ")


def test_takes_rigs_and_calibrations_replace_their_own(folder: Path) -> None:
    rig, take = folder / "rig.usda", folder / "take.usda"
    shot = shoot(folder, bind=folder / "bind.json")
    (folder / "hand.json").write_text('{"shapes": {"jawOpen": {"gain": 1.1}}}')
    new = {name: folder / name for name in ("rig2.usda", "take2.usda", "who.json", "face.glb")}
    (folder / "take.csv").write_text("time,a_x,a_y,a_z\n0,0,0,0\n0.1,0,0,1\n")
    for _ in range(2):
        make_rig(rig, new["rig2.usda"])
        make_take(folder / "take.csv", new["take2.usda"])
        calibrate(shot, new["who.json"])
        export_scene(rig, new["face.glb"])
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    for job in (
        lambda: make_rig(rig, take),
        lambda: make_take(folder / "take.csv", rig),
        lambda: calibrate(shot, folder / "hand.json"),
        lambda: calibrate(shot, folder / "bind.json"),
    ):
        with pytest.raises(OutputError):
            job()
    assert {path: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before
    make_take(folder / "take.csv", rig, overwrite=True)
    assert rig.read_bytes() != before[rig]


@pytest.mark.parametrize("action", ["convert shot.usda", "fit --shot shot.usda", "paper"])
def test_a_fuzzy_system_replaces_no_shot(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    action: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    shoot(folder, bind=folder / "bind.json")
    victim = shoot(folder, "victim.usda", bind=folder / "bind.json")
    monkeypatch.chdir(folder)
    before, words = victim.read_bytes(), ["fuzzy", *action.split(), "-o", "victim.usda"]
    assert main(words) == 1
    assert "victim.usda is a shot, not a fuzzy system; " in capfd.readouterr().err
    assert victim.read_bytes() == before
    for more in (["--overwrite"], []):  # then it is one
        assert main([*words, *more]) == 0
    (folder / "system.fis").write_text("notes")  # text is not looked at
    check_replaced([(folder / "system.fis", "fuzzy system")])


def test_a_gltf_of_another_program_is_kept(folder: Path) -> None:
    place = folder / "face.gltf"
    place.write_text('{"asset": {"version": "2.0", "generator": "Khronos glTF Blender I/O"}}')
    assert main(["export", str(folder / "rig.usda"), "-o", str(place)]) == 1
    assert "Blender" in place.read_text()
    assert main(["export", str(folder / "rig.usda"), "-o", str(place), "--overwrite"]) == 0
    assert main(["export", str(folder / "rig.usda"), "-o", str(place)]) == 0


@pytest.mark.parametrize(
    ("command", "shows"),
    [
        *(("rig", False), ("take", False), ("import", False), ("export", False)),
        *(("fuzzy convert", False), ("fuzzy fit", False), ("fuzzy paper", False)),
        *(("process", True), ("sequence", True), ("shot", True), ("markers", True)),
        ("calibrate", True),
    ],
)
def test_the_help_says_whether_an_edit_shows(
    capsys: pytest.CaptureFixture[str], command: str, shows: bool
) -> None:
    with pytest.raises(SystemExit):
        main([*command.split(), "--help"])
    printed = " ".join(capsys.readouterr().out.split())
    printed = printed[printed.index("replace outputs also where") :][:180]
    assert ("they were edited since usdface wrote them" in printed) == shows
    assert shows or "does not show)" in printed


def test_a_buffer_beside_a_gltf_is_kept(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, buffer = folder / "face.gltf", folder / "face.bin"
    words = ["export", str(folder / "rig.usda"), "-o", str(scene)]
    buffer.write_text("notes")
    assert main(words) == 1 and not scene.exists()
    assert "face.bin is not the buffer of a .gltf that usdface wrote" in capfd.readouterr().err
    assert buffer.read_text() == "notes"
    for more in (["--overwrite"], []):  # then it is
        assert main([*words, *more]) == 0
    buffer.write_text("notes")
    assert main([*words[:-1], str(folder / "face.glb")]) == 0  # has none beside it


@pytest.mark.parametrize(
    "command",
    ["check rig.usda", "fuzzy explain shot.usda", "fuzzy neutral shot.usda", "bench papers"],
)
@pytest.mark.slow
def test_every_report_replaces_one_and_no_other_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, command: str, capfd: pytest.CaptureFixture[str]
) -> None:
    shoot(folder, bind=folder / "bind.json")
    monkeypatch.chdir(folder)
    for _ in range(2):
        assert main([*command.split(), "--report", "report.json"]) == 0
    assert main([*command.split(), "--report", "bind.json"]) == 1
    assert "bind.json is a binding, not a report; choose another name" in capfd.readouterr().err
    assert json.loads(Path("bind.json").read_text()) == make_world().bind
