"""An output replaces what usdface wrote as the same kind, and nothing else unless told to."""

import json
from pathlib import Path

import pytest
from worlds import make_world

from usdface.cli import main
from usdface.errors import OutputError
from usdface.io.replaced import OutputKind, check_replaced
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
    way = "; --overwrite replaces it, another name keeps it"
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
    "text", ["{", "[]", "7", '{"name": "x"}', "[1]", '{"markers": 7}', "[" * 100_000, "\udcff"]
)
def test_other_json_is_of_another_origin(tmp_path: Path, text: str) -> None:
    place = tmp_path / "a.json"
    place.write_bytes(text.encode(errors="surrogateescape"))
    for kind in ("binding", "calibration", "report"):
        assert "another origin" in refusal(place, kind)  # type: ignore[arg-type]


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


def test_a_gltf_of_another_program_is_kept(folder: Path) -> None:
    place = folder / "face.gltf"
    place.write_text('{"asset": {"version": "2.0", "generator": "Khronos glTF Blender I/O"}}')
    assert main(["export", str(folder / "rig.usda"), "-o", str(place)]) == 1
    assert "Blender" in place.read_text()
    assert main(["export", str(folder / "rig.usda"), "-o", str(place), "--overwrite"]) == 0
    assert main(["export", str(folder / "rig.usda"), "-o", str(place)]) == 0


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
