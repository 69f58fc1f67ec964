"""A rig is at rest: motion and poses of its file are announced."""

from pathlib import Path

import numpy as np
import pytest

from usdface.clips import Clip
from usdface.io.gltf.write import write_gltf
from usdface.io.rigs.scene_rig import read_gltf_rig, read_usd_rig
from usdface.io.usd.rig_write import write_rig
from usdface.options import RigOptions
from usdface.rigs import Rig
from usdface.takes import WeightsTake


@pytest.mark.parametrize("suffix", [".usda", ".glb"])
def test_a_pose_that_a_rig_does_not_keep_is_announced(
    face_rig: Rig, tmp_path: Path, suffix: str
) -> None:
    write, read = (write_rig, read_usd_rig) if suffix == ".usda" else (write_gltf, read_gltf_rig)
    names = face_rig.shape_names
    for name, weight in (("rest", 0.0), ("posed", 0.25)):
        weights = np.zeros((1, len(names)))
        weights[0, 1] = weight
        path = tmp_path / f"{name}{suffix}"
        write(face_rig, path, (Clip("", WeightsTake(names, np.zeros(1), weights)),))
        found = [f for f in read(path, RigOptions())[1] if f.code == "ANIMATION_DROPPED"]
        expected = [(str(path), {"channels": [names[1]]})] if weight else []
        assert [(f.where, dict(f.values)) for f in found] == expected
