"""All of a scene that its rig has no place for."""

from collections.abc import Sequence

from pxr import Usd

from usdface.findings import Finding
from usdface.io.usd.extras import prim_of_asset
from usdface.io.usd.groups import paths_of_groups
from usdface.io.usd.materials import report_unbound_materials
from usdface.io.usd.rendered_meshes import report_unconverted
from usdface.io.usd.skel_bindings import skel_bindings, skel_roots
from usdface.io.usd.unconverted_data import (
    report_lost_groups,
    report_other_prims,
    report_unbound_skeletons,
    report_unconverted_data,
    report_unconverted_variants,
)
from usdface.io.usd.unconverted_mesh_parts import report_pivots, report_unconverted_parts
from usdface.rigs import Mesh

__all__ = ["report_unconverted_scene"]


def report_unconverted_scene(
    stage: Usd.Stage, meshes: Sequence[Mesh], top: Usd.Prim | None
) -> list[Finding]:
    """Return findings on the contents of a stage beside the meshes of its rig.

    Parameters
    ----------
    stage : Usd.Stage
    meshes : sequence of Mesh
        Those of the rig, with prim paths of their materials.
    top : Usd.Prim or None
        The prim whose extras are those of the scene. None for a character of the scene alone, whose
        materials may have names: it has no extras, groups, clips and material variants of a scene.
    """
    scene, kept = top is not None, {mesh.path for mesh in meshes}
    if top is not None:
        kept |= {str(top.GetPath()), *paths_of_groups(stage)}
    roots = skel_roots(stage)
    _, skeletons = skel_bindings(roots)
    asset = str(prim_of_asset(top, roots).GetPath()) if top is not None else ""
    return [
        *report_unconverted(stage),
        *report_unconverted_parts(stage, meshes),
        *report_pivots(stage, meshes),
        *report_unconverted_data(stage, kept, asset),
        *report_unconverted_variants(stage, materials=scene, clips=scene),
        *report_other_prims(stage),
        *report_unbound_skeletons(stage, skeletons),
        *report_lost_groups(stage, kept),
        *(report_unbound_materials(stage, meshes) if scene else ()),
    ]
