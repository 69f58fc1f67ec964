from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from other_packages import Install, install

from usdface.errors import InputError, PluginError
from usdface.formats import RigReader
from usdface.io.format_table import Registered
from usdface.io.rigs.files import read_rig_file
from usdface.io.rigs.verify_rig import verified_rig
from usdface.options import RigOptions
from usdface.rigs import BlendShape, MaterialSubset, Mesh, Rig, Skin

__all__ = ["install"]

READER = Registered(
    RigReader(name="HEAD", suffixes=(".head",), read=lambda path, options: ...),  # type: ignore[arg-type,return-value]
    "acme 1.0 (acme:HEAD)",
)
SHAPE = BlendShape.from_dense("smile", np.eye(3))
MESH = Mesh("head", np.eye(3), np.array([3]), np.arange(3), shapes=(SHAPE,))


def test_a_good_rig_comes_back_as_it_is() -> None:
    rig = Rig("r", (replace(MESH, normals=np.eye(3), uvs=np.zeros((3, 2))),))
    assert verified_rig(READER, (rig, [])) == (rig, [])


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"normals": np.full((3, 3), np.nan)}, "normals that are not finite"),
        ({"uvs": np.full((3, 2), np.inf)}, "texture coordinates that are not finite"),
        ({"face_counts": np.array([2, 1])}, "a face of 1 corners"),
        ({"name": ""}, "a name that is no text"),
        ({"skin": Skin(np.zeros((2, 1)), np.ones((2, 1)))}, "a skin (2, 1)"),
        ({"skin": Skin(np.zeros((3, 1)), np.ones((3, 1)))}, "skin joints outside 0 to -1"),
        ({"subsets": (MaterialSubset("m", np.array([1])),)}, "faces of the material 'm'"),
    ],
)
def test_what_the_types_leave_open_is_checked(changes: dict[str, object], reason: str) -> None:
    rig = Rig("r", (replace(MESH, **changes),))  # type: ignore[arg-type]
    with pytest.raises(PluginError) as raised:
        verified_rig(READER, (rig, []))
    assert reason in str(raised.value) and "acme 1.0 (acme:HEAD)" in str(raised.value)


@pytest.mark.parametrize("result", [None, (None, []), (MESH, [])])
def test_what_is_no_rig_is_refused(result: object) -> None:
    with pytest.raises(PluginError, match="expected"):
        verified_rig(READER, result)


SOURCE = """
import numpy as np
from usdface import BlendShape, Mesh, Rig, RigReader

def read(path, options):
    mesh = Mesh("m", np.eye(3), [3], [0, 1, 2], shapes=(BlendShape.from_dense("s", np.eye(3)),))
    return Rig(path.stem, (mesh,)), []

HEAD = RigReader(name="HEAD", suffixes=(".head",), read=read)
SCANS = RigReader(
    name="scans", folder=True, sniff=lambda path: (path / "scan.txt").exists(), read=read
)
"""


def test_files_and_folders_of_another_package_are_rigs(install: Install, tmp_path: Path) -> None:
    install("acme", SOURCE, {"usdface.rigs": {"a": "acme:HEAD", "b": "acme:SCANS"}})
    (tmp_path / "a.head").touch()
    assert read_rig_file(tmp_path / "a.head")[0].shape_names == ("s",)
    with pytest.raises(InputError, match="HEAD has no use for up_axis = 'Z'"):
        read_rig_file(tmp_path / "a.head", RigOptions(up_axis="Z"))
    folder = tmp_path / "scans"
    folder.mkdir()
    (folder / "notes.txt").touch()
    with pytest.raises(InputError, match="folders like this are not read"):
        read_rig_file(folder)
    (folder / "scan.txt").touch()
    assert read_rig_file(folder)[0].name == "scans"
