"""Files with one clip that moves weights only, which is what most tests need."""

from pathlib import Path

from usdface.clips import Clip
from usdface.findings import Finding
from usdface.io.gltf.read import read_gltf
from usdface.io.gltf.reference_player.deformed_mesh import PlayerMesh
from usdface.io.gltf.reference_player.evaluate import evaluate_clips
from usdface.io.usd.clips import clips_of_stage
from usdface.io.usd.stage import Stage
from usdface.rigs import Rig
from usdface.takes import WeightsTake


def plays(take: WeightsTake | None, name: str = "clip") -> tuple[Clip, ...]:
    return () if take is None else (Clip(name, take),)


def weights_in(clips: tuple[Clip, ...]) -> WeightsTake | None:
    moving = [clip for clip in clips if not clip.still]
    assert len(moving) < 2
    return (moving or clips)[0].weights if clips else None


def read_one(path: Path) -> tuple[Rig, WeightsTake | None, list[Finding]]:
    rig, clips, found = read_gltf(path)
    return rig, weights_in(clips), found


def weights_of_stage(stage: Stage) -> WeightsTake | None:
    return weights_in(clips_of_stage(stage)[0])


def evaluate_gltf(path: Path) -> tuple[PlayerMesh, ...]:
    """Return the meshes of a file in its first animation, as the reference player has them."""
    return evaluate_clips(path)[0].meshes
