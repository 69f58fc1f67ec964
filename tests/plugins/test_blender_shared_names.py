"""Names of blend shapes that Blender exports, on stages as it writes them."""

import pytest
from blender_stand_in import extension_parts
from pxr import Usd, UsdGeom, UsdSkel


def test_shape_keys_with_one_name_in_usd_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/root/Head/Head")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    # "smile.L" and "smile L": Blender writes one blend shape, and counts through their names.
    binding.CreateBlendShapesAttr(["smile_L", "smile_L1", "jaw"])
    paths = [mesh.GetPath().AppendChild(name) for name in ("smile_L", "jaw")]
    binding.CreateBlendShapeTargetsRel().SetTargets(paths)
    with extension_parts(monkeypatch) as part:
        names = part("shared_names")
        with pytest.raises(
            part("messages").FaceError, match="shape keys of Head have the same name"
        ):
            names.share_names(stage)
