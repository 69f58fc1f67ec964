"""A USD scene as one `.usdz` package."""

from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdSkel

from usdface.clips import check_clip
from usdface.errors import InputError, OutputError
from usdface.findings import Finding, finding
from usdface.io.asset_folder import asset_folder
from usdface.io.atomic import atomic_path
from usdface.io.temporary_folder import temporary_folder, temporary_full
from usdface.io.usd.clip_variants import clip_stages, playing_animations
from usdface.io.usd.errors import usd_errors, usd_message
from usdface.io.usd.evaluate import stage_keys
from usdface.io.usd.stage import open_stage
from usdface.io.usd.unconverted_data import report_unconverted_variants
from usdface.io.usd.usdz_assets import localise
from usdface.io.usd.usdz_package import write_package
from usdface.io.usd.usdz_stage import complete_stage
from usdface.options import ExportOptions

__all__ = ["write_usdz"]


def write_usdz(source: Path, path: Path, options: ExportOptions = ExportOptions()) -> list[Finding]:
    """Flatten a scene into one binary layer and pack it with its textures.

    AR viewers read only the package's first layer, and only if it is binary; so the
    composed scene is written, not the layers of the shot. Its animation has the final weights,
    corrections included; layers for muting are not in it. Of several clips one plays: that which
    the stage shows, or the one that `options` name.

    The package is written aside, opened and compared. Equal input gives equal bytes.

    Returns
    -------
    list of Finding
        Files that are left out (`usdface.io.usd.usdz_assets.localise`), clips that do not play
        (ANIMATION_DROPPED), variants that are not selected, and values that the
        stage lacked (`usdface.io.usd.usdz_stage`).

    Raises
    ------
    InputError
        If the scene cannot be opened or has no such clip.
    OutputError
        If the package cannot be written; an existing one is unchanged.

    References
    ----------
    OpenUSD, "Usdz File Format Specification".
    """
    root = asset_folder(options.asset_root)
    stage = open_stage(source)
    with usd_errors(str(source)):
        flat, findings = _flattened(stage, options.clip)
        findings += report_unconverted_variants(stage, materials=False)
        findings += complete_stage(flat, source.name)
        assets, more = localise(flat, stage, root)
    with atomic_path(path) as temporary:
        try:
            write_package(temporary, {f"{path.stem}.usdc": _binary(flat), **assets})
            with usd_errors(str(path)):
                open_stage(temporary)
        except Tf.ErrorException as error:
            raise OutputError(f"cannot write {path}: {usd_message(error)}") from error
        except (InputError, OutputError) as error:
            raise OutputError(f"cannot write {path}: {error}") from error
    return findings + more


def _binary(layer: Sdf.Layer) -> bytes:
    with temporary_folder() as folder:
        file = folder / "layer.usdc"
        try:
            if not layer.Export(str(file)):
                raise OutputError("USD could not write the layer")
        except Tf.ErrorException as error:
            raise temporary_full(usd_message(error)) from error
        return file.read_bytes()


def _flattened(stage: Usd.Stage, clip: str) -> tuple[Sdf.Layer, list[Finding]]:
    """Return the flattened stage with the named clip, or with all clips and one that plays."""
    skinned = any(prim.IsA(UsdSkel.Root) for prim in stage.Traverse())
    stages = list(clip_stages(stage)) if skinned else [stage]
    names = [stage_keys(staged)[0] for staged in stages]
    check_clip(clip, [name for name in names if name])
    chosen = stages[names.index(clip) if clip else 0]
    flat = chosen.Flatten(addSourceFileComment=False)
    if not clip:
        message = "a package plays one clip, here {clip}; --clip NAME names another"
        return flat, [
            finding("ANIMATION_DROPPED", name, message, names[0] or "none") for name in names[1:]
        ]
    others = {path for staged in stages for path in playing_animations(staged)} - {
        *playing_animations(chosen)
    }
    edit = Sdf.BatchNamespaceEdit()
    for path in sorted(others):
        edit.Add(path, Sdf.Path.emptyPath)
    flat.Apply(edit)
    return flat, []
