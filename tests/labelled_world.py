"""Takes of the small world in which known emotions are shown, and their labels."""

from pathlib import Path

import numpy as np
from worlds import World, make_world

from usdface.io.usd.take_write import write_take
from usdface.takes import MarkerTake

SHOWN = {
    ("joy", ""): {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
    ("surprise", ""): {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0},
    ("anger", "closed"): {"browDownLeft": 1.0, "browDownRight": 1.0},
    ("anger", "open"): {"browDownLeft": 1.0, "browDownRight": 1.0, "jawOpen": 0.8},
    ("contempt", ""): {"mouthSmileLeft": 0.8, "browOuterUpRight": 0.6},
}
REST, HELD = 12, 18


def labelled_world(folder: Path, takes: int = 2, noise: float = 0.0003) -> World:
    """Write rig, binding, takes and labels.csv to a folder; every take shows all of `SHOWN`."""
    world = make_world(head_moves=False)
    world.write(folder)
    mesh = world.rig.meshes[0]
    at = np.array(list(world.points.values()))
    rng = np.random.default_rng(0)
    lines = ["take,start_frame,end_frame,emotion,variant"]
    ease = np.concatenate([np.linspace(0, 1, 6), np.ones(6), np.linspace(1, 0, 6)])
    for i in range(takes):
        curves = [np.zeros((REST, len(mesh.shapes)))]
        lines.append(f"take_{i}.usda,0,{REST - 5},neutral,")
        for (emotion, variant), pose in SHOWN.items():
            size = rng.uniform(0.85, 1.0, len(mesh.shapes))
            begin = sum(map(len, curves))
            curves.append(ease[:, None] * size * [pose.get(n, 0.0) for n in mesh.shape_names])
            lines.append(f"take_{i}.usda,{begin},{begin + HELD - 1},{emotion},{variant}")
        weights = np.concatenate(curves)
        positions = mesh.points[at] + np.einsum("fs,smd->fmd", weights, mesh.offsets_at(at))
        positions = positions + noise * rng.standard_normal(positions.shape)
        times = np.arange(len(weights)) / 30.0
        take = MarkerTake(tuple(world.points), times, positions, 30.0, source=f"take_{i}")
        write_take(take, folder / f"take_{i}.usda")
    (folder / "labels.csv").write_text("\n".join(lines) + "\n")
    return world
