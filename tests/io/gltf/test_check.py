import base64
import copy
import json

import numpy as np
import pytest

from usdface.errors import InputError
from usdface.io.gltf.check import check_gltf

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
FLAT = [[0, 0, 0]] * 3


def document(arrays, **parts):
    """A glTF with one float accessor for each array, and whatever else is given."""
    data, views, accessors = b"", [], []
    for array in arrays:
        values = np.asarray(array, "<f4")
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes()
        kind = "VEC3" if values.ndim == 2 else "SCALAR"
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": 5126,
                "count": len(values),
                "type": kind,
                "min": np.atleast_1d(np.nan_to_num(values).min(axis=0)).tolist(),
                "max": np.atleast_1d(np.nan_to_num(values).max(axis=0)).tolist(),
            }
        )
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    buffers = [{"byteLength": len(data), "uri": uri}]
    return {
        "asset": {"version": "2.0"},
        "buffers": buffers,
        "bufferViews": views,
        "accessors": accessors,
        **parts,
    }


def sound():
    mesh = {
        "name": "Head",
        "primitives": [
            {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}, {"POSITION": 2}]}
        ],
        "weights": [0, 1],
        "extras": {"targetNames": ["up", "down"]},
    }
    animation = {
        "samplers": [{"input": 3, "output": 4}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
    }
    arrays = [TRIANGLE, TRIANGLE, np.negative(TRIANGLE), [0, 1, 2], [0, 1, 1, 0, 0, 1]]
    return document(arrays, meshes=[mesh], nodes=[{"mesh": 0}], animations=[animation])


def findings_of(tmp_path, changed):
    path = tmp_path / "face.gltf"
    path.write_text(json.dumps(changed))
    return check_gltf(path)


def with_array(place, values):
    changed = sound()
    fresh = document([values])
    changed["buffers"].append(fresh["buffers"][0])
    changed["bufferViews"].append({**fresh["bufferViews"][0], "buffer": 1})
    accessor = {**fresh["accessors"][0], "bufferView": len(changed["bufferViews"]) - 1}
    changed["accessors"][place] = accessor
    return changed


def without(key):
    changed = sound()
    del changed["meshes"][0][key]
    return changed


def changed_mesh(**values):
    changed = sound()
    changed["meshes"][0].update(values)
    return changed


def changed_target(**target):
    changed = sound()
    changed["meshes"][0]["primitives"][0]["targets"][1] = target
    return changed


def second_primitive():
    changed = sound()
    primitives = changed["meshes"][0]["primitives"]
    primitives.append(copy.deepcopy(primitives[0]))
    del primitives[1]["targets"][1]
    return changed


def cubic(output):
    changed = with_array(4, output)
    changed["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"
    return changed


def node_weights(weights):
    changed = sound()
    changed["nodes"][0]["weights"] = weights
    return changed


BROKEN = {
    "no names": (without("extras"), "SHAPE_NAMES_MISSING"),
    "short names": (changed_mesh(extras={"targetNames": ["up"]}), "SHAPE_NAMES_MISMATCH"),
    "same names": (changed_mesh(extras={"targetNames": ["up", "up"]}), "SHAPE_NAME_REPEATED"),
    "unequal": (second_primitive(), "TARGETS_UNEQUAL"),
    "mesh weights": (changed_mesh(weights=[0]), "WEIGHTS_LENGTH_WRONG"),
    "node weights": (node_weights([0, 0, 0]), "WEIGHTS_LENGTH_WRONG"),
    "over-driven": (node_weights([0, 1.5]), "WEIGHTS_OUT_OF_RANGE"),
    "no base": (changed_target(NORMAL=1), "VALUES_WRONG"),
    "no accessor": (changed_target(POSITION=99), "VALUES_WRONG"),
    "count": (changed_target(POSITION=3), "VALUES_WRONG"),
    "nan": (with_array(1, [[0, float("nan"), 0]] * 3), "VALUES_WRONG"),
    "empty": (with_array(2, FLAT), "SHAPE_EMPTY"),
    "nan weights": (with_array(4, [float("nan")] * 6), "VALUES_WRONG"),
    "few weights": (with_array(4, [0, 1, 1]), "WEIGHTS_LENGTH_WRONG"),
    "weights beyond": (with_array(4, [0, 1, 1, 0, 0, -1]), "WEIGHTS_OUT_OF_RANGE"),
    "cubic beyond": (cubic([0, 0, 0, 2, 0, 0] * 3), "WEIGHTS_OUT_OF_RANGE"),
    "cubic short": (cubic([0.0] * 6), "WEIGHTS_LENGTH_WRONG"),
    "times back": (with_array(3, [0, 2, 1]), "VALUES_WRONG"),
    "times negative": (with_array(3, [-1, 0, 1]), "VALUES_WRONG"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_each_fault_is_one_finding(tmp_path, name):
    changed, code = BROKEN[name]
    assert [f.code for f in findings_of(tmp_path, changed)] == [code]


def test_names_on_a_node_are_told_apart_from_none(tmp_path):
    changed = without("extras")
    (none,) = findings_of(tmp_path, changed)
    changed["nodes"][0]["extras"] = {"targetNames": ["up", "out"]}
    (elsewhere,) = findings_of(tmp_path, changed)
    assert none.code == elsewhere.code == "SHAPE_NAMES_MISSING"
    assert "on a node" in elsewhere.message and "on a node" not in none.message


def test_names_on_a_node_are_told_of_its_own_mesh(tmp_path):
    changed = without("extras")
    changed["meshes"] *= 2
    names = {"extras": {"targetNames": ["up", "out"]}}
    changed["nodes"] += [{"mesh": 1}, {"mesh": 1, **names}, names]
    first, second = findings_of(tmp_path, changed)
    assert "on a node" not in first.message and "on a node" in second.message


def test_a_sound_file_has_no_findings(tmp_path):
    assert findings_of(tmp_path, sound()) == []
    # Tangents of cubic curves are no weights: they may be anything.
    assert findings_of(tmp_path, cubic([9, 9, 0, 1, -9, -9] * 3)) == []


@pytest.mark.parametrize("wrong", [{"meshes": [7]}, {"nodes": [{"weights": "x", "mesh": 0}]}])
def test_what_breaks_the_schema_is_one_line(tmp_path, wrong):
    with pytest.raises(InputError) as caught:
        findings_of(tmp_path, {**sound(), **wrong})
    assert "\n" not in str(caught.value)


KHRONOS = {
    "MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT": "VALUES_WRONG",
    "MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR": "VALUES_WRONG",
    "UNRESOLVED_REFERENCE": "VALUES_WRONG",
    "MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT": "TARGETS_UNEQUAL",
    "MESH_INVALID_WEIGHTS_COUNT": "WEIGHTS_LENGTH_WRONG",
    "NODE_WEIGHTS_INVALID": "WEIGHTS_LENGTH_WRONG",
    "ANIMATION_CHANNEL_TARGET_NODE_WEIGHTS_NO_MORPHS": "WEIGHTS_LENGTH_WRONG",
}


def test_we_find_what_the_khronos_validator_finds_in_morph_targets(shared_data):
    seen = set()
    for path in sorted((shared_data / "gltf_validator_morph").glob("*morph*.gltf")):
        report = json.loads(path.with_name(f"{path.name}.report.json").read_text())
        theirs = {m["code"] for m in report["issues"]["messages"]} & set(KHRONOS)
        if theirs:
            ours = {f.code for f in check_gltf(path)}
            assert {KHRONOS[code] for code in theirs} <= ours, path.name
        seen |= theirs
    weights = shared_data / "gltf_validator_morph" / "node_node_weights_invalid.gltf"
    assert "WEIGHTS_LENGTH_WRONG" in {f.code for f in check_gltf(weights)}
    assert len(seen) >= 5  # the comparison has compared something


def test_good_samples_have_no_errors(shared_data):
    for path in (shared_data / "gltf_morph").rglob("*.gltf"):
        assert [f for f in check_gltf(path) if f.severity == "error"] == []


def test_targets_that_leave_the_normals_behind_are_found(tmp_path):
    changed = sound()
    primitive = changed["meshes"][0]["primitives"][0]
    primitive["attributes"]["NORMAL"] = 0
    (found,) = findings_of(tmp_path, changed)
    assert (found.code, found.message) == (
        "NORMALS_MISSING",
        "target 0 and 1 more morphs no NORMAL",
    )
    for target in primitive["targets"]:
        target["NORMAL"] = target["POSITION"]
    assert findings_of(tmp_path, changed) == []


def test_positions_without_bounds_are_found(tmp_path):
    changed = sound()
    del changed["accessors"][1]["min"]
    (found,) = findings_of(tmp_path, changed)
    assert (found.code, found.message) == (
        "BOUNDS_MISSING",
        "POSITION accessor 1 has no min, max",
    )


def test_a_point_that_lies_or_is_moved_far_off_is_found(tmp_path):
    cloud = np.random.default_rng(0).normal(size=(60, 3))
    move = np.full((60, 3), 0.1)

    def found(points, moved):
        primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}]}
        mesh = {"primitives": [primitive], "extras": {"targetNames": ["up"]}}
        path = tmp_path / "far.gltf"
        path.write_text(json.dumps(document([points, moved], meshes=[mesh])))
        return [(f.code, f.where) for f in check_gltf(path)]

    far, dragged = cloud.copy(), move.copy()
    far[5] = dragged[7] = 100.0
    assert found(cloud, move) == []
    assert found(far, move) == [("POINT_STRAY", "mesh 0, primitive 0")]
    assert found(cloud, dragged) == [("POINT_STRAY", "mesh 0, primitive 0, target 0")]


def test_colours_and_texture_coordinates_may_be_morphed(write_glb, tmp_path):
    """Section 3.7.2.2 allows VEC3 and VEC4 colours and VEC2 texture coordinates."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    arrays = [points, np.ones((3, 4), "<f4"), points[:, :2].copy()]
    arrays += [np.full((3, 4), -0.5, "<f4"), np.full((3, 2), 0.25, "<f4"), 0 * points[:2]]
    primitive = {
        "attributes": {"POSITION": 0, "COLOR_0": 1, "TEXCOORD_0": 2},
        "targets": [{"COLOR_0": 3}, {"TEXCOORD_0": 4}],
    }
    document = {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": ["blush", "slide"]}}],
    }
    assert codes(write_glb(tmp_path / "a.glb", document, arrays)) == ["BOUNDS_MISSING"]
    primitive["targets"][0]["COLOR_0"] = 5
    assert "VALUES_WRONG" in codes(write_glb(tmp_path / "b.glb", document, arrays))


def codes(path):
    return [found.code for found in check_gltf(path)]
