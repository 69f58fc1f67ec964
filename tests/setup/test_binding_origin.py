"""A binding knows its mesh and its take: others are refused, or get no frames of it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import make_world

from usdface.binding.binding_report import binding_findings
from usdface.binding.resolve_binding import resolve_binding
from usdface.errors import InputError
from usdface.io.bind_file import bind_json, setup_of_json
from usdface.options import BindOptions
from usdface.rigs import Mesh
from usdface.setup.binding_origin import mesh_difference, origin_of, take_differs
from usdface.setup.retarget_setup import RetargetSetup

WORLD = make_world()
(MESH,) = WORLD.rig.meshes


@pytest.fixture(scope="module")
def saved() -> RetargetSetup:
    """The binding of the world as its file has it."""
    given = setup_of_json(WORLD.bind | {"peaks": [12, 30]}, "bind.json")
    made = resolve_binding(WORLD.rig, WORLD.take, given, options=BindOptions()).setup
    return setup_of_json(json.loads(bind_json(made)), "saved.json")


def changed(**parts: object) -> Mesh:
    return replace(MESH, shapes=(), **parts)  # type: ignore[arg-type]


def test_the_file_keeps_the_origin(saved: RetargetSetup) -> None:
    assert saved.origin == origin_of(MESH, WORLD.take)
    with pytest.raises(InputError, match="made_with"):
        setup_of_json(WORLD.bind | {"made_with": {"points": 3}}, "bind.json")


def test_the_same_faces_in_another_shape_are_the_same_mesh() -> None:
    origin = origin_of(MESH, WORLD.take)
    assert mesh_difference(origin, replace(MESH, points=MESH.points * [1.1, 1.0, 0.9])) == ""


def test_the_difference_of_meshes_is_named() -> None:
    origin = origin_of(MESH, WORLD.take)
    more = changed(points=np.vstack([MESH.points, [[0.0, 0.0, 0.0]]]))
    assert "had 195 points, this one has 196" in mesh_difference(origin, more)
    fewer = changed(face_counts=MESH.face_counts[:-1], face_indices=MESH.face_indices[:-4])
    assert "faces, this one has" in mesh_difference(origin, fewer)
    other = changed(face_indices=np.roll(MESH.face_indices, 1))
    assert "connect other points" in mesh_difference(origin, other)


def test_a_binding_of_another_mesh_is_refused(saved: RetargetSetup) -> None:
    mesh = replace(MESH, face_indices=np.roll(MESH.face_indices, 1))
    rig = replace(WORLD.rig, meshes=(mesh,))
    with pytest.raises(InputError, match="connect other points") as caught:
        resolve_binding(rig, WORLD.take, saved, options=BindOptions())
    assert caught.value.code == "BINDING_OTHER_MESH"
    unknown = replace(saved, origin=None)  # written by hand
    assert resolve_binding(rig, WORLD.take, unknown, options=BindOptions()).setup.origin


def test_its_own_take_keeps_its_frames(saved: RetargetSetup) -> None:
    single = replace(WORLD.take, positions=np.float32(WORLD.take.positions).astype(float))
    assert saved.origin is not None and not take_differs(saved.origin, single)
    kept = resolve_binding(WORLD.rig, single, saved, options=BindOptions())
    assert kept.setup.neutral == saved.neutral and kept.setup.peaks == (12, 30)
    assert kept.other_take == ""


@pytest.mark.parametrize("kind", ["name", "length", "motion"])
def test_another_take_gets_none_of_its_frames_and_is_told(saved: RetargetSetup, kind: str) -> None:
    take = {
        "name": replace(WORLD.take, source="friday.trc"),
        "length": replace(
            WORLD.take, times=WORLD.take.times[:-1], positions=WORLD.take.positions[:-1]
        ),
        "motion": replace(WORLD.take, positions=WORLD.take.positions[::-1] * 1.01),
    }[kind]
    resolved = resolve_binding(WORLD.rig, take, saved, options=BindOptions())
    assert resolved.setup.peaks == () and resolved.neutral_found
    assert "FRAMES_NOT_CARRIED" in {f.code for f in binding_findings(resolved, take)}
    assert resolved.setup.origin == origin_of(MESH, take)
    named = resolve_binding(WORLD.rig, take, saved, options=BindOptions(neutral=(1, 2)))
    assert named.setup.neutral == (1, 2) and not named.neutral_found
    for neutral in ((1, 2), "auto"):  # the remedy that the finding names
        told = resolve_binding(WORLD.rig, take, saved, options=BindOptions(neutral=neutral))
        assert "FRAMES_NOT_CARRIED" not in {f.code for f in binding_findings(told, take)}


def test_a_neutral_of_the_rig_belongs_to_no_take(saved: RetargetSetup) -> None:
    given = replace(saved, neutral=None, neutral_weights={})
    take = replace(WORLD.take, source="friday.trc")
    assert resolve_binding(WORLD.rig, take, given, options=BindOptions()).setup.neutral is None


def test_the_command_refuses_and_tells(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from usdface.cli import main

    folder = WORLD.write(tmp_path)
    shot = ["shot", f"--rig={folder}/rig.usda", f"--take={folder}/take.usda", "-o"]
    written = ["--write-bind", f"{folder}/made.json"]
    assert main([*shot, f"{folder}/a.usda", f"--bind={folder}/bind.json", *written]) == 0
    made = json.loads((folder / "made.json").read_text())
    assert made["made_with"]["points"] == 195
    made["made_with"]["points"] = 7
    (folder / "made.json").write_text(json.dumps(made))
    assert main([*shot, f"{folder}/b.usda", f"--bind={folder}/made.json"]) == 1
    assert "that had 7 points, this one has 195" in capfd.readouterr().err
    assert not (folder / "b.usda").exists()
