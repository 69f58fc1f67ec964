"""A result is kept where a run would make it again, and made anew after any change."""

import errno
import json
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from composed import image
from other_packages import Install, install
from pxr import Sdf
from worlds import make_world

from usdface.cli import main
from usdface.errors import InputError, OutputError, PluginError, UsdFaceError
from usdface.findings import Finding
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file
from usdface.io.usd.file_kind import kind_of_usd
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Texture
from usdface.pipeline import process, process_sequence
from usdface.pipeline.farm_jobs import write_sequence_job
from usdface.pipeline.sequence import plans_of
from usdface.pipeline.shot_task import file_role, run_shot
from usdface.show import keys
from usdface.show.plan import Making, ShotPlan

__all__ = ["install"]


def plan_in(folder: Path) -> ShotPlan:
    """A shot that is made of all kinds of files."""
    making = Making(rig=folder / "rig.usda", take=folder / "take.usda", bind=folder / "bind.json")
    return ShotPlan(name="a", file=folder / "shots/a.usda", making=making)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A shot with a texture, made and processed; and one over it, with a layer of its own."""
    folder = make_world().write(tmp_path_factory.mktemp("show"))
    (folder / "skin.png").write_bytes(image("skin"))
    texture = Texture(str(folder / "skin.png"), suffix=".png")
    rig = make_world().rig
    meshes = tuple(replace(mesh, material="skin") for mesh in rig.meshes)
    skin = Material("skin", base_color_texture=texture)
    write_rig(replace(rig, meshes=meshes, materials=(skin,)), folder / "rig.usda")
    run_shot({"plan": plan_in(folder).as_dict()})
    return folder


@pytest.fixture
def place(made: Path, tmp_path: Path) -> Path:
    """A copy of it: a show that was moved keeps its results."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    (tmp_path / "list.txt").write_text("shots/a.usda\n")
    return tmp_path


def show(place: Path, more: str = "") -> Path:
    (place / "show.toml").write_text(
        f'folder = "shots"\n{more}\n[[shots]]\nname = "a"\nrig = "rig.usda"\ntake = "take.usda"\n'
        'bind = "bind.json"\n'
    )
    return place / "show.toml"


def state(place: Path, more: str = "") -> str:
    """Whether the result is what a run would make: kept, or missing."""
    (row,) = process_sequence(show(place, more), gather=True).value
    return row.state


def spoil(path: Path, old: bytes, new: bytes) -> None:
    """Change one byte of a file."""
    content = path.read_bytes()
    assert old in content and len(old) == len(new) == 1
    at = content.rindex(old)
    path.write_bytes(content[:at] + new + content[at + 1 :])


def test_an_unchanged_shot_is_kept_also_after_a_move(place: Path) -> None:
    assert state(place) == "kept"


@pytest.mark.parametrize(
    "name", ["shots/a.usda", "rig.usda", "take.usda", "rig_textures/skin.png", "bind.json"]
)
def test_one_byte_of_any_input_counts(place: Path, name: str) -> None:
    file = next(f for f in place.rglob(Path(name).name))
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    assert state(place) == "missing"
    content[-1] ^= 1
    file.write_bytes(content)
    assert state(place) == "kept"


FULL = """folder = "shots"
[characters.mia]
rig = "rig.usda"
bind = "bind.json"
fuzzy = "own.usda"
expressions = "poses.json"
layer = "sets/mia.usda"
[performers.anna]
calibration = "anna.json"
layer = "sets/anna.usda"
[[shots]]
name = "a"
take = "take.usda"
performer = "anna"
character = "mia"
"""


@pytest.fixture(scope="module")
def full(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A show with each kind of file that a shot can be made of, processed."""
    folder = make_world().write(tmp_path_factory.mktemp("full"))
    system = read_fuzzy_file(made / "shots/a.usda")[0]
    write_fuzzy_file(folder / "own.usda", system)
    (folder / "poses.json").write_text('{"joy": {"shapes": {"mouthSmileLeft": 0.75}}}\n')
    (folder / "anna.json").write_text('{"shapes": {"jawOpen": {"gain": 1.25}}}\n')
    (folder / "show.toml").write_text(FULL)
    result = process_sequence(folder / "show.toml", workers=1)
    assert result.value[0].state == "processed", result.value[0].error
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        *("rig.usda", "take.usda", "bind.json", "own.usda", "poses.json", "anna.json"),
        *("sets/mia.usda", "sets/anna.usda", "shots/a.usda"),
    ],
)
def test_one_byte_of_all_that_a_shot_is_made_of_counts(full: Path, name: str) -> None:
    def state() -> str:
        return process_sequence(full / "show.toml", gather=True).value[0].state

    content = (full / name).read_bytes()
    assert state() == "kept"
    (full / name).write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert state() == "missing"
    (full / name).write_bytes(content)
    assert state() == "kept"


@pytest.mark.parametrize(
    "name", ["a.usdface.usda", "a.usdface/solve.usdc", "a.usdface/express.usdc"]
)
def test_a_result_that_was_touched_or_is_missing_is_made_again(place: Path, name: str) -> None:
    file = place / "shots" / name
    content = file.read_bytes()
    file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert state(place) == "missing"
    file.unlink()
    assert state(place) == "missing"
    file.write_bytes(content)
    assert state(place) == "kept"


@pytest.mark.parametrize(
    "more",
    [
        "process = {gltf = true}",
        "process = {page = true}",
        "process = {express = false}",
        "process = {deliver = true}",
        "process = {deliver = {handles = 8}}",
        "process = {exaggeration = {brows = 1.2}}",
        "process = {solve = 'frame'}",
    ],
)
def test_any_option_counts(place: Path, more: str) -> None:
    assert state(place, more) == "missing"
    assert state(place) == "kept"


@pytest.mark.parametrize(
    ("name", "value"),
    [("_version", lambda name: "9.9"), ("_usdface_groups", lambda: {"usdface": [Plugged()]})],
)
def test_the_program_counts(
    place: Path, monkeypatch: pytest.MonkeyPatch, name: str, value: Callable[..., object]
) -> None:
    monkeypatch.setattr(keys, name, value)
    keys.program.cache_clear()
    try:
        assert state(place) == "missing"
    finally:
        monkeypatch.undo()
        keys.program.cache_clear()
    assert state(place) == "kept"


@pytest.fixture
def failing_hook(install: Install) -> Iterator[None]:
    """A package whose hook stops every shot."""
    entries = {"usdface.hooks": {"take_read": "acme_half:fail"}}
    install("acme_half", "def fail(*given):\n    raise RuntimeError('no licence')\n", entries)
    keys.program.cache_clear()
    yield
    keys.program.cache_clear()


def test_hooks_that_are_skipped_do_not_run_and_count(place: Path, failing_hook: None) -> None:
    (plain,) = plans_of([show(place)])
    with pytest.raises(PluginError, match="--skip-hook acme_half:take_read"):
        run_shot({"plan": plain.as_dict()})
    (plan,) = plans_of([show(place)], skip_hooks=["acme_half"])
    run_shot({"plan": plan.as_dict()})
    assert state(place, "process = {skip_hooks = ['acme_half']}") == "kept"
    (row,) = process_sequence(show(place), skip_hooks=["acme_half"], gather=True).value
    assert row.state == "kept"
    assert state(place) == "missing"


def test_results_with_pages_are_gathered_with_them(place: Path) -> None:
    (plan,) = plans_of([show(place)], pages=True)
    run_shot({"plan": plan.as_dict()})
    gather = ["sequence", str(show(place)), "--gather", "--format", "json"]
    assert main([*gather, "--pages"]) == 0
    assert main(gather) == 1


def test_a_hook_to_skip_that_is_not_installed_is_an_error_before_any_work(place: Path) -> None:
    with pytest.raises(InputError, match="--skip-hook acme: there is no such hook"):
        process_sequence(show(place, "process = {skip_hooks = ['acme']}"))
    with pytest.raises(InputError, match="--skip-hook acme: there is no such hook"):
        process_sequence(show(place), skip_hooks=["acme"])


class Plugged:
    """A format of another package."""

    group, name, value, dist = "usdface.takes", "mine", "mine:read", None


def test_a_link_that_leads_elsewhere_counts(place: Path) -> None:
    shutil.copy(place / "take.usda", place / "take_2.usda")
    spoil(place / "take_2.usda", b"0", b"1")
    shutil.move(place / "take.usda", place / "take_1.usda")
    (place / "take.usda").symlink_to("take_1.usda")
    run_shot({"plan": plan_in(place).as_dict()})
    assert state(place) == "kept"
    (place / "take.usda").unlink()
    (place / "take.usda").symlink_to("take_2.usda")
    assert state(place) == "missing"


def test_numbered_files_beside_one_that_is_read_count(tmp_path: Path) -> None:
    for name in ("skin.1001.png", "skin.1002.png", "hair.1001.png", "skin.png"):
        (tmp_path / name).touch()
    found = keys.numbered_siblings([tmp_path / "skin.1001.png", tmp_path / "skin.png"])
    assert found == {str(tmp_path / "skin.#.png"): ["skin.1001.png", "skin.1002.png"]}


@pytest.mark.slow
def test_a_shot_is_made_anew_from_a_changed_binding_but_not_over_edits(place: Path) -> None:
    plan, shot = plan_in(place), place / "shots/a.usda"
    before = shot.read_bytes()
    bind = (place / "bind.json").read_text()
    (place / "bind.json").write_text(bind.replace('"end": 3', '"end": 2'))
    row = run_shot({"plan": plan.as_dict()})
    assert shot.read_bytes() != before and "SHOT_KEPT" not in row["findings"]
    assert state(place) == "kept"
    shot.write_text(shot.read_text().replace("usdface:gain = 1", "usdface:gain = 0.5"))
    edited = shot.read_bytes()
    assert state(place) == "missing"
    run_shot({"plan": plan.as_dict()})
    assert state(place) == "kept"
    (place / "bind.json").write_text(bind)
    row = run_shot({"plan": plan.as_dict()})
    assert shot.read_bytes() == edited and row["findings"]["SHOT_KEPT"] == 1
    # Until shot or files change again there is nothing to do, and the table still tells.
    (row,) = process_sequence(show(place), gather=True).value
    assert row.state == "kept" and row.findings["SHOT_KEPT"] == 1
    (place / "bind.json").write_text(bind.replace('"end": 3', '"end": 1'))
    assert state(place) == "missing"
    shot.unlink()
    row = run_shot({"plan": plan.as_dict()})
    assert "SHOT_KEPT" not in row["findings"]
    (place / "bind.json").write_text(bind)
    assert state(place) == "missing"  # the record of the edited shot is not that of the new one


def state_naming(place: Path, **named: str) -> str:
    """Whether the result is kept, or missing, where the show names other files; "" = none."""
    values = {"rig": "rig.usda", "take": "take.usda", "bind": "bind.json", **named}
    lines = [f'{key} = "{value}"' for key, value in values.items() if value]
    text = "\n".join(['folder = "shots"', "[[shots]]", 'name = "a"', *lines])
    (place / "show.toml").write_text(text)
    (row,) = process_sequence(place / "show.toml", gather=True).value
    return row.state


@pytest.mark.parametrize("role", ["rig", "take", "bind"])
def test_another_file_counts_also_with_the_same_content(place: Path, role: str) -> None:
    name = {"rig": "rig.usda", "take": "take.usda", "bind": "bind.json"}[role]
    shutil.copy(place / name, place / f"other_{name}")
    assert state_naming(place, **{role: f"other_{name}"}) == "missing"
    assert state_naming(place) == "kept"


@pytest.mark.parametrize(
    "named",
    [
        *({"calibration": "anna.json"}, {"fuzzy": "own.usda"}, {"expressions": "poses.json"}),
        *({"character_layer": "mia.usda"}, {"performer_layer": "anna.usda"}, {"bind": ""}),
    ],
)
def test_a_file_more_or_less_counts(place: Path, named: dict[str, str]) -> None:
    assert state_naming(place, **named) == "missing"
    assert state_naming(place) == "kept"


def test_another_name_of_the_same_file_does_not_count(place: Path) -> None:
    (place / "link.usda").symlink_to("take.usda")
    for name in (str(place / "take.usda"), "shots/../take.usda", "link.usda"):
        assert state_naming(place, take=name) == "kept"
    (place / "shown").symlink_to(place)
    (row,) = process_sequence(place / "shown/show.toml", gather=True).value
    assert row.state == "kept"
    (place / "link.usda").unlink()
    shutil.copy(place / "take.usda", place / "link.usda")
    assert state_naming(place, take="link.usda") == "missing"


def test_a_shot_is_made_anew_from_another_take(place: Path) -> None:
    shutil.copy(place / "take.usda", place / "take_2.usda")
    assert state_naming(place, take="take_2.usda") == "missing"
    (row,) = process_sequence(place / "show.toml", workers=1).value
    assert row.state == "processed" and not row.error
    text = (place / "shots/a.usda").read_text()
    assert "take_2.usda" in text and "@../take.usda@" not in text
    assert state_naming(place, take="take_2.usda") == "kept"


def test_the_findings_of_making_a_shot_stay_in_its_row(place: Path) -> None:
    plan = replace(plan_in(place), name="b", file=place / "shots/b.usda")
    first = run_shot({"plan": plan.as_dict()})
    again = run_shot({"plan": replace(plan, gltf=True).as_dict()})
    made = json.loads((place / "shots/b.usdface/made.json").read_text())["row"]["findings"]
    assert set(made) & set(first["findings"])
    assert set(first["findings"]) <= set(again["findings"]) and again["notes"] >= first["notes"]
    (place / "shots/b.usda").write_text((place / "shots/b.usda").read_text() + "\n")
    edited = run_shot({"plan": plan.as_dict()})
    assert edited["findings"] == first["findings"] and edited["notes"] == first["notes"]


def unsign(path: Path) -> None:
    """Make a layer what a version without fingerprints wrote."""
    layer = Sdf.Layer.FindOrOpen(str(path))
    mine = dict(layer.customLayerData["usdface"])
    del mine["fingerprint"]
    layer.customLayerData = {"usdface": mine} if mine else {}
    layer.Save()


def test_results_of_an_older_version_are_replaced_if_the_record_knows_them(place: Path) -> None:
    plan = replace(plan_in(place), deliver={})
    run_shot({"plan": plan.as_dict()})
    unsign(plan.deliver_path)
    record = place / "shots/a.usdface/record.json"
    with pytest.raises(OutputError, match=r"a\.face\.usdc may hold edits; an older version wrote"):
        run_shot({"plan": plan.as_dict()})
    known = json.loads(record.read_text())
    known["outputs"]["a.face.usdc"] = keys.file_digest(plan.deliver_path)  # as that version did
    record.write_text(json.dumps(known))
    run_shot({"plan": plan.as_dict()})
    assert kind_of_usd(plan.deliver_path) == ("deliverable", "")


@pytest.mark.slow
def test_an_edited_result_is_replaced_only_if_told_to(place: Path) -> None:
    root, file = place / "shots/a.usdface.usda", show(place)
    root.write_text(f'{root.read_text()}\nover "Mine" {{}}\n')
    (row,) = process_sequence(file, workers=1).value
    assert row.code == "OUTPUT_UNWRITABLE" and "was edited since" in row.error
    (row,) = process_sequence(file, workers=1, overwrite=True).value
    assert row.state == "processed" and "Mine" not in root.read_text()


@pytest.mark.slow
def test_an_edited_layer_is_replaced_only_if_told_to(place: Path) -> None:
    path, file = place / "shots/a.usdface/solve.usdc", show(place)
    before = path.read_bytes()
    layer = Sdf.Layer.FindOrOpen(str(path))
    layer.comment = "mine"
    layer.Save()
    (row,) = process_sequence(file, workers=1).value
    assert row.code == "OUTPUT_UNWRITABLE" and "solve.usdc was edited since" in row.error
    (row,) = process_sequence(file, workers=1, overwrite=True).value
    assert row.state == "processed" and path.read_bytes() == before


def test_a_full_disk_fails_the_shot_and_leaves_the_old_result(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (place / "shots/a.usda").write_text((place / "shots/a.usda").read_text() + "\n")
    before = {f: f.read_bytes() for f in (place / "shots").rglob("*") if f.is_file()}

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OutputError, match="No space left"):
        run_shot({"plan": plan_in(place).as_dict()})
    monkeypatch.undo()
    assert {f: f.read_bytes() for f in (place / "shots").rglob("*") if f.is_file()} == before


def test_a_folder_of_shots_that_cannot_be_made_is_an_output_that_cannot(tmp_path: Path) -> None:
    (tmp_path / "shots").touch()
    with pytest.raises(OutputError, match=r"a\.usda: .*shots is no folder"):
        run_shot({"plan": plan_in(tmp_path).as_dict()})


def test_an_input_that_changes_meanwhile_is_not_recorded(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from usdface.pipeline import shot_task

    (place / "shots/a.usda").write_text((place / "shots/a.usda").read_text() + "\n")
    whole = shot_task.process

    def process(*args: object, **kwargs: object) -> object:
        result = whole(*args, **kwargs)  # type: ignore[arg-type]
        spoil(place / "take.usda", b"0", b"1")
        return result

    monkeypatch.setattr(shot_task, "process", process)
    run_shot({"plan": plan_in(place).as_dict()})
    assert state(place) == "missing"


def test_a_record_of_another_form_is_none(place: Path) -> None:
    record = place / "shots/a.usdface/record.json"
    whole = record.read_text()
    for text in ("", "[]", "{}", "[" * 100_000, whole.replace('"good"', "3"), whole[:-3]):
        record.write_text(text)
        assert state(place) == "missing"
    record.write_text(whole)
    assert state(place) == "kept"


def test_a_layer_over_a_result_is_no_shot(place: Path) -> None:
    """As an animator's: its result would lie over what it edits."""
    shots = place / "shots"
    over = Sdf.Layer.CreateNew(str(shots / "a_anim.usda"))
    over.subLayerPaths.append("./a.usdface.usda")
    over.Save()
    assert file_role(shots / "a.usda") == "shot" and file_role(shots / "a_anim.usda") == "other"
    process(shots / "a.usda", in_place=True)  # a result in the shot itself
    assert file_role(shots / "a.usda") == "shot"
    shutil.copy(shots / "a.usda", shots / "b.usda")  # the next version, over the same result
    assert file_role(shots / "b.usda") == "shot" and file_role(shots / "a_anim.usda") == "other"


def test_a_layer_over_a_shot_with_its_result_in_itself_is_left_out_and_reported(
    place: Path,
) -> None:
    """Before, it was a shot; the result that is now below it does not show in its name."""
    shots = place / "shots"
    over = Sdf.Layer.CreateNew(str(shots / "a_light.usda"))
    over.subLayerPaths.append("./a.usda")
    over.Save()
    assert file_role(shots / "a_light.usda") == "shot"
    process(shots / "a.usda", in_place=True)
    result = process_sequence(shots, gather=True)
    assert [row.name for row in result.value] == ["a"]
    job = write_sequence_job(shots, place / "job", root=place)
    for findings in (result.findings, job.findings):
        left_out = [found.where for found in findings if found.code == "SHOT_LEFT_OUT"]
        assert left_out == [str(shots / "a_light.usda")]


def test_a_result_of_any_name_and_a_layer_over_it_are_no_shots(place: Path) -> None:
    shots = place / "shots"
    process(shots / "a.usda", output=shots / "larger.usda")
    over = Sdf.Layer.CreateNew(str(shots / "larger_anim.usda"))
    over.subLayerPaths.append("./larger.usda")
    over.Save()
    assert file_role(shots / "larger.usda") == file_role(shots / "larger_anim.usda") == "other"


def test_a_layer_is_reported_once_as_left_out_and_not_where_it_is_named(place: Path) -> None:
    shots = place / "shots"
    over = Sdf.Layer.CreateNew(str(shots / "a_light.usda"))
    over.subLayerPaths.append("./a.usda")
    over.Save()
    process(shots / "a.usda", in_place=True)
    for sources, count in (([shots, shots], 1), ([shots, shots / "a_light.usda"], 0)):
        left_out: list[Finding] = []
        plans = plans_of(sources, left_out=left_out)
        assert (len(left_out), len(plans)) == (count, 2 - count)


@pytest.mark.parametrize("layers", ["@./a.usda@", "@./b.usda@"])
def test_layers_in_a_circle_are_refused(tmp_path: Path, layers: str) -> None:
    (tmp_path / "a.usda").write_text(f"#usda 1.0\n(\n    subLayers = [{layers}]\n)\n")
    (tmp_path / "b.usda").write_text("#usda 1.0\n(\n    subLayers = [@./a.usda@]\n)\n")
    assert file_role(tmp_path / "a.usda") == "shot"
    with pytest.raises(UsdFaceError, match="does not compose"):
        run_shot({"plan": ShotPlan(name="a", file=tmp_path / "a.usda").as_dict()})
