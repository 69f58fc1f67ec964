"""Rigs, takes, bindings and results read into arrays."""

from pathlib import Path

from usdface.arguments import checked
from usdface.findings import Finding
from usdface.io import bind_file
from usdface.io.atomic import StrPath
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes import files as take_files
from usdface.io.usd.played_shot import read_played_shot
from usdface.io.usd.stage import open_stage
from usdface.options import RigOptions, TakeOptions
from usdface.pipeline.schemas import register_schemas
from usdface.rigs import Rig
from usdface.setup.retarget_setup import RetargetSetup
from usdface.shot.played_shot import PlayedShot
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["read_bind", "read_result", "read_rig", "read_take"]


@checked
def read_rig(path: StrPath, *, options: RigOptions = RigOptions()) -> tuple[Rig, list[Finding]]:
    """Read a character: UsdSkel, glTF, a folder of OBJ or PLY meshes, or MakeHuman targets.

    Parameters
    ----------
    path : path
    options : RigOptions
        Unit, up axis and neutral mesh of a folder of meshes, which does not name them.

    Returns
    -------
    Rig
        In metres, Y up.
    list of Finding
        Everything that was dropped, guessed or approximated.

    Raises
    ------
    InputError
        If it is no rig, cannot be read, or has no blend shapes.

    Examples
    --------
    >>> rig, findings = usdface.read_rig("examples/head.usdc")
    >>> rig.meshes[0].points.shape[1], len(rig.shape_names)
    (3, 52)
    """
    register_schemas()
    return read_rig_file(Path(path), options)


@checked
def read_take(
    path: StrPath, *, options: TakeOptions = TakeOptions()
) -> tuple[MarkerTake | WeightsTake, list[Finding]]:
    """Read a take: C3D, TRC, CSV, BVH, Live Link Face, or USD.

    Parameters
    ----------
    path : path
    options : TakeOptions
        Unit, up axis, rate in place of the file's own. A take in USD carries them itself: options
        for it are an error.

    Returns
    -------
    MarkerTake or WeightsTake
        In metres (pixels, of an image), seconds, Y up.
    list of Finding
        Everything that was dropped, guessed or approximated.

    Raises
    ------
    InputError
        If it is no take, or cannot be used.

    Examples
    --------
    >>> take, _ = usdface.read_take("examples/performance.trc")
    >>> take.positions.shape == (len(take.times), len(take.names), 3)
    True
    """
    register_schemas()
    return take_files.read_take(Path(path), options)


@checked
def read_bind(path: StrPath) -> tuple[RetargetSetup, list[Finding]]:
    """Read a binding file, JSON: which vertex each marker sits on, neutral frames, nose tip.

    Parameters
    ----------
    path : path

    Returns
    -------
    RetargetSetup
    list of Finding
        NEUTRAL_ASSUMED where it names no neutral frames.

    Raises
    ------
    InputError
        If it is no such file.

    Examples
    --------
    >>> setup, _ = usdface.read_bind("examples/bind.json")
    >>> len(setup.binding.markers) == len(setup.binding.points)
    True
    """
    return bind_file.read_bind(Path(path))


@checked
def read_result(path: StrPath) -> tuple[PlayedShot, list[Finding]]:
    """Read a processed shot as its layers hold it: weights, emotions, firing rules, residual.

    Parameters
    ----------
    path : path
        The root layer that `process` wrote. A shot that was not processed is read, too; its curves
        are empty.

    Returns
    -------
    PlayedShot
    list of Finding

    Raises
    ------
    InputError
        If it cannot be opened, or has no setup.

    Examples
    --------
    >>> result = usdface.process("examples/shot.usda")
    >>> played, _ = usdface.read_result(result.written[0])
    >>> played.solved.weights.shape == played.corrected.weights.shape
    True
    """
    register_schemas()
    return read_played_shot(open_stage(Path(path)), str(path))
