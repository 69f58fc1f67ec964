"""three.js and Blender show the conversion cases as UsdSkel does, vertex by vertex."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import KDTree
from test_conversion_cases import CASES

from usdface.io.usd.evaluate import evaluate_usd
from usdface.io.usd.stage import open_stage
from usdface.pipeline import export_scene, import_scene

pytestmark = pytest.mark.slow

Case = tuple[str, Path, list[np.ndarray], list[float]]  # name, GLB, vertices at times [s]

# [s], within the clips; where keys are and between them
TIMES = {".usda": [0.25, 0.5, 1.0, 1.25], ".glb": [0.25, 0.5, 0.75]}
# Of the size: UsdSkel rounds scales of joints to 16 bits between two samples, ...
HALF = {
    "certificate_double_remap/skin_reorder.usda": 2e-3,
    "mesh_xform_euler/skin_xform_anim.usda": 2e-3,
}
# ... and Blender goes from one quaternion to the next by their components, not along the arc.
STRAIGHT = HALF | {
    "weights_not_normalised/skin_unnormalised.glb": 1e-2,
    "mesh_weights_lost/default_weights_other_anim.glb": 1e-3,
}


@pytest.fixture(params=CASES)
def case(request, shared_data: Path, tmp_path: Path) -> Case:
    """A case as GLB, ours or theirs, and where UsdSkel shows its vertices at some times."""
    source = shared_data / "conversion_cases" / request.param
    if source.suffix == ".glb":
        import_scene(source, tmp_path / "a.usda")
        glb, stage = source, open_stage(tmp_path / "a.usda")
    else:
        export_scene(source, tmp_path / "a.glb")
        glb, stage = tmp_path / "a.glb", open_stage(source)
    times = TIMES[source.suffix]
    codes = np.array(times) * stage.GetTimeCodesPerSecond()
    meshes = [mesh.points_at(codes) for mesh in evaluate_usd(stage)]
    truth = [np.concatenate(parts) for parts in zip(*meshes, strict=True)]
    return request.param, glb, truth, times


def compare(shown: list[Any], truth: list[np.ndarray], tolerance: float) -> None:
    """Every vertex of each side is near one of the other."""
    for mine, theirs in zip(truth, shown, strict=True):
        other = np.array(theirs)
        size = float(np.linalg.norm(np.ptp(mine, axis=0)))
        near = tolerance * size
        assert KDTree(mine).query(other)[0].max() < near
        assert KDTree(other).query(mine)[0].max() < near


def test_three_shows_what_usdskel_shows(case: Case, three: Callable[..., dict[str, Any]]) -> None:
    name, glb, truth, times = case
    clip = "dance" if "unnormalised" in name else ""
    shown = three(glb, times, 0.0, clip, points=True)["points"]
    compare(shown, truth, HALF.get(name, 1e-4))


def test_blender_shows_what_usdskel_shows(
    case: Case, blender: Callable[..., dict[str, Any]]
) -> None:
    name, glb, truth, times = case
    shown = blender(glb, [round(60 * t) for t in times], points=True)["points"]
    compare(shown, truth, STRAIGHT.get(name, 1e-4))
