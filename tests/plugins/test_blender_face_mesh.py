"""Which mesh of a character markers sit on in Blender, against stand-ins for its objects."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

FILE = Path(__file__).parents[2] / "plugins" / "blender" / "extension" / "face_mesh.py"


@pytest.fixture
def face_of(monkeypatch: pytest.MonkeyPatch) -> Any:
    blender: Any = ModuleType("bpy")
    blender.types = SimpleNamespace(Object=object, ShapeKey=object)
    monkeypatch.setitem(sys.modules, "bpy", blender)
    spec = importlib.util.spec_from_file_location("face_mesh_of_blender", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.face_of


class Points(list[tuple[float, float, float]]):
    """The coordinates of a shape key."""

    def foreach_get(self, _: str, out: np.ndarray) -> None:
        out[:] = np.ravel(self)


def mesh(
    name: str, size: float, moving: str, still: str = "", scale: float = 1.0
) -> SimpleNamespace:
    """A mesh of two points, of which each shape key moves both, or none."""
    rest = Points([(0.0, 0.0, 0.0), (size, 0.0, 0.0)])
    basis = SimpleNamespace(name="Basis", data=rest)
    basis.relative_key = basis
    blocks = [basis]
    for key in (*moving, *still):
        up = 0.01 if key in moving else 0.0
        data = Points([(x, y + up, z) for x, y, z in rest])
        blocks.append(SimpleNamespace(name=key, data=data, relative_key=basis))
    keys = SimpleNamespace(key_blocks=blocks, reference_key=basis)
    data = SimpleNamespace(shape_keys=keys, vertices=rest)
    return SimpleNamespace(name=name, data=data, matrix_world=scale * np.eye(4))


@pytest.mark.parametrize(
    "others",
    [
        [mesh("EyeLeft", 0.03, "ab", "cdefgh")],  # all shape keys of the head, most of them empty
        [mesh("Lashes", 0.06, "abcdefg", "h")],
        [mesh("Eyes", 6.0, "abcdefgh", scale=0.01)],
        [mesh("Teeth", 0.06, "abcdefghi")],  # and one of its own
        [mesh("Brows", 0.06, "abcdefgh"), mesh("Tongue", 0.05, "abc")],
        [],
    ],
)
def test_the_head_carries_the_markers(face_of: Any, others: list[SimpleNamespace]) -> None:
    head = mesh("Wolf3D_Head", 0.2, "abcdefgh")
    assert face_of([*others, head]) is head
    assert face_of([head, *others]) is head


def test_clothes_are_no_face(face_of: Any) -> None:
    """They may be larger, and have shape keys of their own."""
    head = mesh("Head", 0.2, "abcdefgh")
    assert face_of([mesh("Coat", 1.0, "xyz"), head]) is head


def test_shape_keys_that_move_nothing_leave_the_first(face_of: Any) -> None:
    both = [mesh("One", 0.1, "", "ab"), mesh("Two", 0.2, "", "a")]
    assert face_of(both) is both[0]
