import json
import os
import subprocess
import sys

import pytest
import usd_validators

from usdface.findings.codes import CODES
from usdface.io.usd.check import check_usd

STAGE = """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
    defaultPrim = "R"
)
def SkelRoot "R" (prepend apiSchemas = ["SkelBindingAPI"])
{
    rel skel:skeleton = </R/Skel>

    def Skeleton "Skel" {}

    def Mesh "M" (prepend apiSchemas = ["SkelBindingAPI"])
    {
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 2, 3)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        float3[] extent = [(0, 0, 0), (1, 2, 3)]
        uniform token[] skel:blendShapes = ["up", "down"]
        rel skel:blendShapeTargets = [</R/M/up>, </R/M/down>]

        def BlendShape "up"
        {
            uniform vector3f[] offsets = [(0, 0, 1)]
            uniform int[] pointIndices = [7]
        }

        def BlendShape "down"
        {
            uniform vector3f[] offsets = [(0, 0, -1), (0, 0, -1)]
            uniform int[] pointIndices = [1, 1]
        }
    }
}
"""
# A program of its own: what is registered with USD stays so.
PROGRAM = """
import json, sys
from pxr import Usd, UsdValidation
stage = Usd.Stage.Open(sys.argv[1])
registry = UsdValidation.ValidationRegistry()
name = sys.argv[2]
validators = registry.GetOrLoadValidatorsByName([name])
errors = UsdValidation.ValidationContext(validators).Validate(stage)
print(json.dumps([
    [e.GetName(), str(e.GetType()).split(".")[-1], str(e.GetSites()[0].GetPrim().GetPath())]
    for e in errors
]))
"""
TYPES = {"Error": "error", "Warn": "warning", "Info": "info"}


@pytest.mark.slow
@usd_validators.needed
@pytest.mark.parametrize("way", ["plugin path", "import"])
def test_usd_validation_finds_what_our_check_finds(way, tmp_path):
    from usdface.schemas import plugin_dir

    path = tmp_path / "broken.usda"
    path.write_text(STAGE)
    folder = plugin_dir().parent / "io" / "usd" / "validation"
    environment, program = dict(os.environ), PROGRAM
    if way == "plugin path":
        environment["PXR_PLUGINPATH_NAME"] = str(folder)
    else:
        program = "import usdface.io.usd.validation\n" + program
    name = "usdface.io.usd.validation:BlendShapes"
    done = subprocess.run(
        [sys.executable, "-c", program, str(path), name],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert [(code, where) for code, _, where in found] == [
        ("POINT_INDICES_OUTSIDE", "/R/M/up"),
        ("POINT_INDICES_REPEATED", "/R/M/down"),
    ]
    assert all(TYPES[kind] == CODES[code][0] for code, kind, _ in found)
    assert [(f.code, f.where) for f in check_usd(path)] == [(c, w) for c, _, w in found]
