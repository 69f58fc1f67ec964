"""A batch of files: one that cannot be read does not hide the others."""

from pathlib import Path

import numpy as np
import pytest

import usdface
from usdface.cli import main
from usdface.errors import InputError
from usdface.io.gltf.write import write_gltf
from usdface.rigs import BlendShape, Mesh, Rig

FACE = Mesh("Face", np.eye(3), [3], [0, 1, 2], shapes=(BlendShape("jawOpen", [1], [[0, 0, 1]]),))
RIG = Rig("r", (FACE,))


def test_every_file_of_a_batch_is_reported(tmp_path: Path, capfd) -> None:
    good, torn, gone = (tmp_path / name for name in ("a.glb", "torn.glb", "gone.usda"))
    write_gltf(RIG, good)
    torn.write_bytes(good.read_bytes()[:500])
    found = usdface.check([torn, good, gone]).findings
    unread = [(f.code, f.where) for f in found if f.severity == "error"]
    assert unread == [("FILE_UNREADABLE", str(torn)), ("FILE_UNREADABLE", str(gone))]
    assert main(["check", str(torn), str(good), str(gone)]) == 1
    assert capfd.readouterr().out.count("FILE_UNREADABLE") >= 1
    with pytest.raises(InputError):
        usdface.check(torn)


def test_findings_of_several_files_begin_with_their_file(tmp_path: Path, capfd) -> None:
    """ "mesh 0" is in each of them; of one file it needs no more."""
    still = Mesh("Face", np.eye(3), [3], [0, 1, 2], shapes=(BlendShape("none", [1], [[0, 0, 0]]),))
    first, other = tmp_path / "a.glb", tmp_path / "b.glb"
    write_gltf(Rig("r", (still,)), first)
    write_gltf(Rig("r", (still,)), other)
    (alone,) = (f for f in usdface.check(first).findings if f.code == "SHAPE_EMPTY")
    assert not alone.where.startswith(str(tmp_path))
    found = [f.where for f in usdface.check([first, other]).findings if f.code == "SHAPE_EMPTY"]
    assert found == [f"{path}: {alone.where}" for path in (first, other)]
    main(["check", str(first), str(other)])
    (line,) = (x for x in capfd.readouterr().out.splitlines() if "SHAPE_EMPTY" in x)
    assert str(first) in line and str(other) in line


def test_vrm_files_are_glb_files(tmp_path: Path) -> None:
    write_gltf(RIG, tmp_path / "a.glb")
    path = (tmp_path / "a.glb").rename(tmp_path / "avatar.vrm")
    assert usdface.check(path).findings == ()
    assert usdface.import_scene(path, tmp_path / "a.usda").summary["meshes"] == 1
    assert usdface.make_rig(path, tmp_path / "b.usda").summary["meshes"] == 1
