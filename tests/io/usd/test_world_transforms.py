"""Transforms of prims to the world."""

import numpy as np
from pxr import Gf, Usd, UsdGeom

from usdface.io.usd.world_transforms import moves_in_world, world_transform


def test_what_moves_above_a_prim_moves_it() -> None:
    stage = Usd.Stage.CreateInMemory()
    above = UsdGeom.Xform.Define(stage, "/above")
    UsdGeom.Scope.Define(stage, "/above/scope")  # has no transform of its own
    below = UsdGeom.Xform.Define(stage, "/above/scope/below")
    below.AddTranslateOp().Set(Gf.Vec3d(1, 0, 0))
    assert not moves_in_world(below.GetPrim())
    move = above.AddTranslateOp()
    for code in (0.0, 2.0):
        move.Set(Gf.Vec3d(0, code, 0), code)
    assert moves_in_world(below.GetPrim())
    np.testing.assert_allclose(world_transform(below.GetPrim(), 1.0)[3, :3], [1, 1, 0])
    assert not moves_in_world(stage.GetPseudoRoot())
