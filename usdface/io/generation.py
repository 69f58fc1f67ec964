"""The generation of a result: an id that its layers and its glTF share.

It is a digest of the animation, so the same shot gives the same. A layer has it in
``customLayerData["usdface"]["generation"]``, a glTF in ``asset.extras.usdface``, beside the name of
the root layer that it belongs to (``result``).
"""

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from usdface.findings import Finding, finding
from usdface.io.gltf.external_files import metadata_of

if TYPE_CHECKING:  # `usdface check` reads generations and needs no solve
    from usdface.shot.shot import ShotResult

__all__ = ["Generation", "generation_of", "gltf_generation", "outdated_gltf"]

_MOST_FILES = 200  # files of a folder that are read
_LENGTH = 16  # hexadecimal digits

Generation = dict[str, str]  # "generation" and "result", as a glTF has them


def generation_of(result: "ShotResult", root: Path) -> Generation:
    """Return the generation of a result with the root layer `root`."""
    digest = hashlib.sha256(json.dumps(result.weights.names).encode())
    arrays = [result.weights.times, result.solved.weights, result.weights.weights]
    if result.head_motion is not None:
        arrays += [result.head_motion.rotations, result.head_motion.translations]
    for eye in result.eye_motions:
        arrays += [eye.motion.rotations, eye.motion.translations]
    for array in arrays:
        digest.update(np.ascontiguousarray(array, np.float32).tobytes())
    return {"generation": digest.hexdigest()[:_LENGTH], "result": root.name}


def gltf_generation(path: Path) -> Generation | None:
    """Return the generation that a glTF names; None where it names none or cannot be read."""
    ours = metadata_of(path)
    made = {key: ours.get(key) for key in ("generation", "result")}
    if not all(isinstance(value, str) for value in made.values()):
        return None
    return {key: str(value) for key, value in made.items()}


def outdated_gltf(folder: Path, now: Generation, written: Iterable[Path]) -> list[Finding]:
    """Return GLTF_OUTDATED for each glTF in a folder that is of an earlier generation of a result.

    Files that have just been `written` are not.
    """
    new = {path.resolve() for path in written}
    files = sorted(path for kind in ("*.glb", "*.gltf") for path in folder.glob(kind))
    found = []
    for path in files[:_MOST_FILES]:
        old = None if path.resolve() in new else gltf_generation(path)
        if old and old["result"] == now["result"] and old != now:
            found.append(finding("GLTF_OUTDATED", path.name))
    return found
