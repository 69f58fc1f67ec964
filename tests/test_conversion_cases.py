"""Small scenes that were once converted or checked wrongly: each is right, or says what it loses.

Evaluated by UsdSkel and by the independent glTF player (the certificate); every glTF that is
written passes the Khronos validator. three.js and Blender: tests/judges/test_cases.py.
"""

from pathlib import Path

import pytest

import usdface
from usdface.errors import UsdFaceError

# What the conversion of a file announces beyond infos, and the largest distance of a vertex [mm].
CASES: dict[str, tuple[set[str], float]] = {
    "certificate_double_remap/skin_reorder.usda": (set(), 1e-3),
    "check_false_positive/targets_color_uv.glb": ({"FEATURE_DROPPED"}, 1e-3),
    "concave/ngons.usda": (set(), 1e-3),
    "doublesided/doublesided_mixed.glb": ({"FEATURE_APPROXIMATED"}, 1e-3),
    "facevarying_normals/facevarying.usda": (set(), 1e-3),
    "flat_normals_smoothed/no_normals.glb": (set(), 1e-3),
    "gprims_silent/othergprims.usda": ({"FEATURE_DROPPED"}, 1e-3),
    "gprims_silent/pointinstancer.usda": ({"FEATURE_DROPPED"}, 1e-3),
    "groups_lost/groups.glb": (set(), 1e-3),
    "instanced_false_dropped/instanced.usda": (set(), 1e-3),
    "materials/mat_default.usda": (set(), 1e-3),
    "materials/mat_timesample.usda": (set(), 1e-3),
    "mesh_weights_lost/default_weights.glb": (set(), 1e-3),
    "mesh_weights_lost/default_weights_other_anim.glb": (set(), 1e-3),
    "mesh_xform_euler/mesh_xform_anim.usda": (set(), 1e-2),
    # The scales of its joints move between 16-bit numbers, which UsdSkel rounds anew in between.
    "mesh_xform_euler/skin_xform_anim.usda": ({"CONVERSION_INEXACT"}, 2.0),
    "purpose_visibility/purposes.usda": ({"FEATURE_DROPPED", "ANIMATION_DROPPED"}, 1e-3),
    "purpose_visibility/root_invisible.usda": ({"FEATURE_APPROXIMATED"}, 1e-3),
    "skin_no_common_root/quad_skin.glb": (set(), 0.1),
    "two_faces/two_roots.usda": (set(), 1e-3),
    "value_clips/valueclips.usda": (set(), 1e-3),
    "vertexcache/vertexcache.usda": (set(), 1e-2),
    "vrm_extension_silent/unknown_ext.glb": ({"EXTENSION_DROPPED"}, 1e-3),
    # 16-bit scales of joints
    "weights_not_normalised/skin_unnormalised.glb": ({"CONVERSION_INEXACT"}, 0.1),
}
# What check finds beyond infos.
FAULTS = {
    "check_false_negatives/anim_names_typo.usda": {"ANIMATION_UNMATCHED"},
    "check_false_negatives/anim_one_typo.usda": {"SHAPE_UNKNOWN"},
    "check_false_negatives/api_not_applied.usda": {"SCHEMA_UNAPPLIED"},
    "check_false_negatives/no_skeleton.usda": {"SKELETON_MISSING"},
    "check_false_negatives/not_skelroot.usda": {"SKELROOT_MISSING"},
    "flat_normals_smoothed/no_normals.glb": {"SHAPE_NAMES_MISSING"},
}


@pytest.fixture(scope="module")
def cases(shared_data: Path) -> Path:
    if not (shared_data / "conversion_cases").is_dir():
        pytest.skip("the conversion cases are not beside this clone")
    return shared_data / "conversion_cases"


def test_every_case_is_judged(cases: Path) -> None:
    parts = {"in_base.usda", "vc_clip0.usda", "vc_clip1.usda", "vc_manifest.usda", "vc_model.usda"}
    there = {path for path in cases.rglob("*.*") if path.suffix in (".usda", ".glb")}
    named = {path.relative_to(cases).as_posix() for path in there if path.name not in parts}
    assert named == CASES.keys() | FAULTS.keys()


@pytest.mark.parametrize("name", CASES)
def test_it_is_right_or_announced(cases: Path, tmp_path: Path, validate_gltf, name: str) -> None:
    announced, millimetres = CASES[name]
    source = cases / name
    if source.suffix == ".glb":
        done = usdface.import_scene(source, tmp_path / "a.usda", every_frame=True)
        usdface.export_scene(tmp_path / "a.usda", tmp_path / "a.glb")
    else:
        done = usdface.export_scene(source, tmp_path / "a.glb", every_frame=True)
    assert {f.code for f in done.findings if f.severity != "info"} == announced
    assert done.value is not None and done.value.missing == ()
    assert done.summary["vertex_error_max_mm"] <= millimetres
    assert validate_gltf(tmp_path / "a.glb")["issues"]["numErrors"] == 0


def test_check_finds_the_faults_and_no_others(cases: Path) -> None:
    found = {}
    for path in sorted([*cases.rglob("*.usda"), *cases.rglob("*.glb")]):
        codes = {f.code for f in usdface.check(path).findings if f.severity != "info"}
        found |= {path.relative_to(cases).as_posix(): codes} if codes else {}
    assert found == FAULTS


def test_what_stands_still_is_refused_or_announced(cases: Path, tmp_path: Path) -> None:
    for name in FAULTS:
        if "false_negatives" not in name:
            continue
        try:
            done = usdface.export_scene(cases / name, tmp_path / "a.glb", every_frame=True)
            assert any(f.severity != "info" for f in done.findings), name
        except UsdFaceError as error:
            assert error.code == "FACE_MISSING" and "not_skelroot" in name
