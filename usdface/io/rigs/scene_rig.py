"""The character of a glTF or USD scene, without its animations."""

from collections.abc import Sequence
from pathlib import Path

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import asset_folder
from usdface.options import RigOptions
from usdface.rigs import Rig

__all__ = ["read_gltf_rig", "read_usd_rig"]


def read_gltf_rig(path: Path, options: RigOptions) -> tuple[Rig, list[Finding]]:
    """Read the rig of a glTF file, which is in metres, Y up.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    from usdface.io.gltf.read import read_gltf  # neither loads the other's libraries

    rig, clips, findings = read_gltf(path, asset_folder(options.asset_root))
    return rig, findings + _dropped(clips)


def read_usd_rig(path: Path, options: RigOptions) -> tuple[Rig, list[Finding]]:
    """Read the rig of a USD file, which names its units.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    from usdface.io.usd.clips import clips_of_stage
    from usdface.io.usd.rig import read_rig
    from usdface.io.usd.stage import open_stage

    rig, findings = read_rig(path, asset_folder(options.asset_root))
    try:
        return rig, findings + _dropped(clips_of_stage(open_stage(path))[0])
    except InputError as error:  # an animation that is left out anyhow
        message = "left out, as it cannot be read: {error}"
        return rig, [*findings, finding("ANIMATION_DROPPED", "", message, error)]


def _dropped(clips: Sequence[Clip]) -> list[Finding]:
    message = "a rig stands still; `usdface import` and `export` keep animations"
    return [finding("ANIMATION_DROPPED", clip.name, message) for clip in clips if not clip.still]
