from pathlib import Path

import numpy as np

from usdface.io.gltf.skin_weights import normalised_weights
from usdface.pipeline import import_scene

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
JOINTS = np.array([[0, 1, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]], "<u1")


def test_weights_are_those_that_programs_play() -> None:
    given = np.array([[0.5, 0.25], [2.0, 0.0], [0.0, 0.0], [0.5, -0.5], [0.25, 0.75]])
    weights, found = normalised_weights(given, "m")
    expected = [[2 / 3, 1 / 3], [1, 0], [1, 0], [1, 0], [0.25, 0.75]]
    np.testing.assert_allclose(weights, expected)
    assert {f.code for f in found} == {"SKIN_WEIGHTS_NORMALISED", "FEATURE_APPROXIMATED"}
    assert "off by up to 1" in found[1].message


def test_sums_within_rounding_stay_to_the_bit() -> None:
    given = np.array([[0.3, 0.7], [0.1, 0.9]], np.float32).astype(float)
    weights, found = normalised_weights(given, "m")
    assert found == [] and (weights == given).all()


def test_usd_shows_what_a_player_shows(write_glb, tmp_path: Path) -> None:
    """A pulled joint: every weight counts, and the judges normalise by themselves."""
    weights = np.array([[0.2, 0.2, 0, 0], [0.5, 0, 0, 0], [0, 0, 0, 0]], "<f4")
    times = np.array([0, 1], "<f4")
    pulled = np.array([[0, 0, 0], [0, 0, 5]], "<f4")
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    document = {
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [{"children": [1]}, {}, {"mesh": 0, "skin": 0}],
        "skins": [{"joints": [0, 1]}],
        "meshes": [{"primitives": [{"attributes": attributes}]}],
        "animations": [
            {
                "samplers": [{"input": 3, "output": 4}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
            }
        ],
    }
    path = write_glb(tmp_path / "a.glb", document, [POINTS, JOINTS, weights, times, pulled])
    done = import_scene(path, tmp_path / "a.usda", every_frame=True)
    assert {f.code for f in done.findings} == {"SKIN_WEIGHTS_NORMALISED", "NORMALS_FLAT"}
    assert done.summary["vertex_error_max_mm"] < 1e-3


def test_usd_weights_that_do_not_sum_to_one_are_reported(skinned_rig, tmp_path: Path) -> None:
    from dataclasses import replace

    from usdface.io.gltf.write import write_gltf
    from usdface.rigs import Skin

    (mesh,) = skinned_rig.meshes
    half = replace(mesh, skin=Skin(mesh.skin.joints, mesh.skin.weights / 2))
    found = write_gltf(replace(skinned_rig, meshes=(half,)), tmp_path / "a.glb")
    assert "FEATURE_APPROXIMATED" in {f.code for f in found}
