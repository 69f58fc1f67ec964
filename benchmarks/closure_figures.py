"""Figures of the closure layer for `benchmarks/sensitivity.py closure`.

The first half of the recording on another person's face: with its blinks, 41 and 68 markers, and
with three sets of squints, glances and smiles in their place, 41 markers; and AnimFace's takes on
the ICT face.
"""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from benchmarks import closure  # noqa: E402
from usdface import assemble_shot, read_bind  # noqa: E402
from usdface.io.takes.files import read_take  # noqa: E402
from usdface.options import ProcessOptions  # noqa: E402
from usdface.rigs import Rig  # noqa: E402
from usdface.shot.retarget import retarget  # noqa: E402

# Of the pulses that take the place of blinks.
SEEDS = (5, 6, 17)


def figures() -> dict[str, float]:
    """Return closings that are found, incomplete and false, and how long eyes are shut wrongly."""
    mesh = closure.ict_mesh(closure.SHARED)
    recorded = closure.recorded(mesh, 0)
    few, many = (closure.World(*each) for each in closure.layouts().items())
    others = [closure.without_blinks(recorded, np.random.default_rng(seed)) for seed in SEEDS]
    takes = [(recorded, few), (recorded, many), *((take, few) for take in others)]
    scores, seconds = [], 0.0
    for shown, world in takes:
        result = closure.run(mesh, shown, world, 0)
        assert result.closure is not None
        own = closure.scored(shown, result.closure.eyes)
        seconds += float(np.mean([each.wrong for each in own])) * len(shown.times) / shown.rate
        scores += own
    found = {
        "found": float(sum(each.heard for each in scores)),
        "incomplete": float(sum(each.partial for each in scores)),
        "false": float(sum(each.false for each in scores)),
        "shut wrongly s": seconds,
    }
    bind, _ = read_bind(ROOT / "tests" / "data" / "animface_ict_bind.json")
    for name in ("Jaw", "Eyebrows"):
        take, _ = read_take(closure.SHARED / "animface" / f"{name}.c3d")
        shot = assemble_shot(Rig("Face", (mesh,)), take, setup=bind)[0]
        result = retarget(shot, options=ProcessOptions(express=False))
        assert result.closure is not None
        found[name] = float(len(result.closure.closings))
    return found


if __name__ == "__main__":
    print(figures())
