"""Every real file goes to the other format and back, or is refused with a code."""

from pathlib import Path

import pytest
from round_trips import FOLDERS, round_trip, sources

from usdface.errors import ERROR_CODES, UsdFaceError
from usdface.io.check import check_file
from usdface.pipeline import import_scene

# File, and the code it is refused with. The others convert.
REFUSED = {
    "mayausd_morpher/morpher_box.usd": "WEIGHTS_LENGTH_WRONG",
    "openusd_usdskel/bakeSkinning/baseline/blendshapes.baked.usda": "FACE_MISSING",
    "openusd_usdskel/bakeSkinning/baseline/blendshapesWithNormals.baked.usda": "FACE_MISSING",
    "openusd_usdskel/bakeSkinning/baseline/lbs.baked.usda": "FACE_MISSING",
    "openusd_usdskel/misc/badSkelBindingAPIApplied.usda": "FACE_MISSING",
    "openusd_usdskel/misc/badSkelBindingNoSkelRoot.usda": "FACE_MISSING",
    "openusd_usdskel/misc/cleanSkelBindingAPIApplied.usda": "FACE_MISSING",
    "openusd_usdskel/misc/populate.usda": "FACE_MISSING",
    "tinyusdz_blendshape/inbetween-blendshape-001.usda": "FACE_MISSING",
    "tinyusdz_blendshape/inbetween-blendshape-002.usda": "FILE_UNREADABLE",
}
# glTF skins linearly: dual quaternions become what they are near to, and the certificate says so.
INEXACT = "openusd_usdskel/bakeSkinning/dqs.usda"
HERE = Path(__file__).resolve().parents[2] / "shared" / "data"
LONG = "robotexpressive/RobotExpressive.glb"  # 14 clips of 43 joints
FILES = [path.relative_to(HERE).as_posix() for path in sources(HERE)] or ["none"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n == LONG else n for n in FILES]
)
def test_there_and_back(name, shared_data, tmp_path, validate_gltf):
    trip = round_trip(shared_data / name, tmp_path, validate_gltf)
    assert trip.refused == REFUSED.get(name, "")
    if trip.refused:
        assert list(tmp_path.iterdir()) == []
        return
    assert trip.names[0] == trip.names[1]
    for leg in trip.legs:
        assert leg.judged == ()
        if name == INEXACT and "FEATURE_DROPPED" in leg.codes:
            assert "CONVERSION_INEXACT" in leg.codes
        else:
            assert leg.vertices <= 5e-6  # two legs: 1e-5 of the bounding diagonal
        assert leg.certificate["weight_error_max"] <= 1e-6
        assert leg.certificate["time_drift_s"] <= 5e-7
        assert leg.certificate["missing"] == []
        assert "CONVERSION_UNCERTIFIED" not in leg.codes


def test_the_folders_are_there(shared_data):
    assert {name.partition("/")[0] for name in FILES} == set(FOLDERS)
    assert set(REFUSED) <= set(FILES)


def test_what_the_khronos_validator_rejects_is_rejected_or_reported(
    shared_data, validate_gltf, tmp_path
):
    for path in sorted((shared_data / "gltf_validator_morph").glob("*.gltf")):
        if validate_gltf(path)["issues"]["numErrors"] == 0:
            continue
        try:
            codes = {f.code for f in import_scene(path, tmp_path / f"{path.stem}.usda").findings}
            codes |= {f.code for f in check_file(path) if f.severity != "info"}
            assert codes, path.name
        except UsdFaceError as error:
            assert error.code in ERROR_CODES, path.name
            assert not list(tmp_path.glob(f"{path.stem}*"))
