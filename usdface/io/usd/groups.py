"""Groups of a scene as Xforms in the scope ``/Asset/Groups``, read and written."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from usdface.arrays import FloatArray
from usdface.findings import Finding, finding
from usdface.io.usd.conversion_metadata import KEY, read_metadata, write_metadata
from usdface.io.usd.extras import json_values, read_extras, usd_values, write_extras
from usdface.rigs import Mesh, Rig
from usdface.scene import Extras, Group

__all__ = ["read_groups", "write_groups"]

_SCOPE = "Groups"
_START = Usd.TimeCode.EarliestTime()


def read_groups(
    stage: Usd.Stage, si: FloatArray, meshes: Sequence[Mesh]
) -> tuple[tuple[Group, ...], dict[str, Extras], tuple[Mesh, ...], list[Finding]]:
    """Return the groups that `write_groups` wrote, extras of joints, and meshes in their groups.

    `si` (4, 4) leads from stage space to metres, Y up.
    """
    scope = next((p for p in stage.Traverse() if p.GetName() == _SCOPE and _holds_groups(p)), None)
    if scope is None:
        return (), {}, tuple(meshes), []
    xforms = UsdGeom.XformCache(_START)
    found: list[Finding] = []
    groups = []
    for prim in Usd.PrimRange(scope):
        if not prim.IsA(UsdGeom.Xform):
            continue
        matrix = np.array(xforms.GetLocalToWorldTransform(prim), np.float64) @ si
        extras, new_findings = read_extras(prim)
        found += new_findings
        name = str(prim.GetDisplayName() or prim.GetName())
        path = str(prim.GetPath().MakeRelativePath(scope.GetPath()))
        joint = str(read_metadata(prim).get("joint", ""))
        groups.append(Group(path, name, matrix, joint, extras))
    joints, new_findings = json_values(scope, read_metadata(scope).get("joints", {}))
    found += new_findings
    known = {group.path for group in groups}
    grouped = []
    for mesh in meshes:
        path = str(read_metadata(stage.GetPrimAtPath(mesh.path)).get("group", ""))
        grouped.append(replace(mesh, group=path) if path in known else mesh)
    return tuple(groups), joints, tuple(grouped), found


def _holds_groups(prim: Usd.Prim) -> bool:
    return prim.IsA(UsdGeom.Scope) and read_metadata(prim).get("groups") is True


def write_groups(stage: Usd.Stage, rig: Rig) -> list[Finding]:
    """Define an Xform for each group, where it stands at rest; the stage is in metres, Y up.

    Joints are no prims: a group that hangs on one notes its path.
    """
    if not rig.groups and not rig.joint_extras:
        return []
    scope = UsdGeom.Scope.Define(stage, f"/Asset/{_SCOPE}").GetPrim()
    write_metadata(scope, "groups", True)
    found: list[Finding] = []
    worlds: dict[str, FloatArray] = {}
    for group in rig.groups:
        made = UsdGeom.Xform.Define(stage, scope.GetPath().AppendPath(Sdf.Path(group.path)))
        above = worlds.get(group.path.rpartition("/")[0], np.eye(4))
        worlds[group.path] = group.matrix
        place = group.matrix @ np.linalg.pinv(above)
        made.AddTransformOp().Set(Gf.Matrix4d(*place.ravel().tolist()))
        prim = made.GetPrim()
        if prim.GetName() != group.name:
            prim.SetDisplayName(group.name)
            message = "was {original!r}"
            found.append(finding("NAME_CHANGED", str(prim.GetPath()), message, group.name))
        if group.joint:
            write_metadata(prim, "joint", group.joint)
        found += write_extras(prim, group.extras)
    if rig.joint_extras:
        values, new_findings = usd_values(scope, rig.joint_extras)
        found += new_findings
        scope.SetCustomDataByKey(f"{KEY}:joints", values)
    return found
