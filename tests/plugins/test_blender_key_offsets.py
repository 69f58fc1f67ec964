"""Shape keys of a vertex group, or relative to another key, against stand-ins for Blender's."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from blender_stand_in import extension_parts
from pxr import Sdf, Usd, UsdGeom, UsdSkel

SMILE, JAW = (
    np.array([[0, 1, 0], [0, 2, 0], [0, 0, 0.0]]),
    np.array([[0, 0, 0], [0, 0, 4], [5, 0, 0.0]]),
)


@pytest.fixture
def extension(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    with extension_parts(monkeypatch) as part:
        yield part("key_offsets")


def exported(**keys: np.ndarray) -> Usd.Stage:
    """A mesh of three points as Blender exports it: each key's difference to the basis."""
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/root/Head/Mesh")
    mesh.CreatePointsAttr([(0, 0, 0)] * 3)
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateBlendShapesAttr(list(keys))
    paths = [mesh.GetPath().AppendChild(name) for name in keys]
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
    for path, offsets in zip(paths, keys.values(), strict=True):
        shape, moved = UsdSkel.BlendShape.Define(stage, path), np.flatnonzero(offsets.any(axis=1))
        shape.CreateOffsetsAttr(offsets[moved].tolist())
        shape.CreatePointIndicesAttr(moved.tolist())
    return stage


def head(count: int = 3, **keys: tuple[str, str]) -> SimpleNamespace:
    """The object in Blender: of each key its vertex group and the key that it is relative to."""
    blocks = {"Basis": SimpleNamespace(name="Basis", vertex_group="")}
    blocks |= {name: SimpleNamespace(name=name, vertex_group=g) for name, (g, _) in keys.items()}
    blocks["Basis"].relative_key = blocks["Basis"]
    for name, (_, relative) in keys.items():
        blocks[name].relative_key = blocks[relative or "Basis"]
    left = [[SimpleNamespace(group=3, weight=w)] for w in (0.25, 1.0)] + [[]]
    vertices = [SimpleNamespace(index=i, groups=g) for i, g in enumerate([*left, []][:count])]
    data = SimpleNamespace(
        vertices=vertices,
        shape_keys=SimpleNamespace(key_blocks=[*blocks.values()], reference_key=blocks["Basis"]),
    )
    return SimpleNamespace(name="Head", data=data, vertex_groups={"left": SimpleNamespace(index=3)})


def shown(stage: Usd.Stage, name: str) -> np.ndarray:
    shape = UsdSkel.BlendShape.Get(stage, Sdf.Path(f"/root/Head/Mesh/{name}"))
    dense = np.zeros((3, 3))
    dense[np.array(shape.GetPointIndicesAttr().Get(), int)] = shape.GetOffsetsAttr().Get()
    return dense


@pytest.mark.parametrize(
    ("of", "expected"),
    [
        (("", ""), SMILE),
        (("left", ""), SMILE * [[0.25], [1.0], [0.0]]),
        (("", "jaw"), SMILE - JAW),
        (("left", "jaw"), (SMILE - JAW) * [[0.25], [1.0], [0.0]]),
        (("removed", ""), SMILE),
        (("", "smile"), SMILE),
    ],
)
def test_a_key_is_exported_as_blender_shows_it(
    extension: Any, of: tuple[str, str], expected: np.ndarray
) -> None:
    stage = exported(jaw=JAW, smile=SMILE)
    extension.show_keys_as_blender(stage, [head(jaw=("", ""), smile=of)])
    np.testing.assert_allclose(shown(stage, "smile"), expected, atol=1e-6)
    np.testing.assert_allclose(shown(stage, "jaw"), JAW, atol=1e-6)


def test_a_mesh_with_other_points_stays(extension: Any) -> None:
    """As of an exporter that applied a modifier."""
    stage = exported(smile=SMILE)
    extension.show_keys_as_blender(stage, [head(4, smile=("left", ""))])
    np.testing.assert_allclose(shown(stage, "smile"), SMILE)
