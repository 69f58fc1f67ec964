"""The character of a glTF or USD scene, without its animations."""

from collections.abc import Sequence
from pathlib import Path

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.face.own_names import with_own_names
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
    # Names that its animations tell apart, in a rig that stands still.
    rig, changed = with_own_names(rig)
    kept = {name for own in changed.values() for name in own}
    found = [f for f in findings if f.code != "NAME_CHANGED" or f.values.get("name") not in kept]
    return rig, found + _dropped(clips, path)


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
    rig, changed = with_own_names(rig)
    message = "names that were made unique are those of the prims or of the glTF again: {shapes}"
    findings += [finding("NAME_CHANGED", w, message, list(own)) for w, own in changed.items()]
    try:
        return rig, findings + _dropped(clips_of_stage(open_stage(path))[0], path)
    except InputError as error:  # an animation that is left out anyhow
        message = "left out, as it cannot be read: {error}"
        return rig, [*findings, finding("ANIMATION_DROPPED", "", message, error)]


def _dropped(clips: Sequence[Clip], path: Path) -> list[Finding]:
    message = "a rig stands still; `usdface import` and `export` keep animations"
    found = [finding("ANIMATION_DROPPED", clip.name, message) for clip in clips if not clip.still]
    message = "it stands in a pose, which a rig does not keep: {channels}"
    posed = [names for clip in clips if clip.still and (names := _posed(clip))]
    return found + [finding("ANIMATION_DROPPED", str(path), message, names) for names in posed]


def _posed(clip: Clip) -> list[str]:
    """Return the blend shapes and joints that a pose moves."""
    take = clip.weights
    shapes = (
        [] if take is None else [n for n, w in zip(take.names, take.weights[0], strict=True) if w]
    )
    return [*shapes, *(clip.joints.joints if clip.joints is not None else ())]
