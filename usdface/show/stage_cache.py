"""The cache of a shot's stages, clean-up, solve and correction, keyed by their inputs."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from usdface.blend_shapes.combination_weight import CombinationWeight
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.inbetween_path import InbetweenPath
from usdface.cleanup.clean import Cleaned
from usdface.cleanup.repairs import Repair
from usdface.closure.closed_eyes import CompletedClosing
from usdface.closure.closure_layer import Closure
from usdface.closure.eye_closing import EyeClosing
from usdface.closure.lid_apertures import LidApertures
from usdface.closure.mistracked_lids import MistrackedLid
from usdface.content_digest import content_digest
from usdface.correction.expression_layer import ExpressionTrace, SideTrace
from usdface.errors import OutputError
from usdface.findings import Finding, finding
from usdface.fuzzy.inference import Evaluation
from usdface.geometry.rigid_fit import Pose
from usdface.retarget.film.filmed_head import FilmedHead
from usdface.retarget.film.one_camera import PinholeCamera
from usdface.retarget.joint_motion import JointMotion
from usdface.retarget.map_choice import MapChoice
from usdface.retarget.rbf import SpaceMap
from usdface.retarget.solution import Solution
from usdface.retarget.take_estimates import TakeEstimates
from usdface.shot.retarget_pieces import EstimatedTake, SolvedPiece
from usdface.shot.shot import ShotResult, SolvedShot
from usdface.show.keys import program
from usdface.show.packed import UnpackError, read_packed, write_packed
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["StageCache"]

# Of results; inputs, which they refer to, are not written.
_CLASSES = (
    *(BlendShapeEvaluator, Cleaned, Closure, CombinationWeight, CompletedClosing, EstimatedTake),
    *(Evaluation, ExpressionTrace, EyeClosing, FilmedHead, Finding, InbetweenPath, LidApertures),
    *(
        JointMotion,
        MapChoice,
        MarkerTake,
        MistrackedLid,
        PinholeCamera,
        Pose,
        Repair,
        ShotResult,
        SideTrace,
    ),
    *(Solution, SolvedPiece, SolvedShot, SpaceMap, TakeEstimates, WeightsTake),
)
_KEPT = 2  # files of each stage, so that a setting can be changed back

ValueT = TypeVar("ValueT")


class StageCache:
    """Stages of one shot in a folder, which other shots may share.

    A file that is damaged, or not written by this class, is ignored.

    Parameters
    ----------
    folder : Path
    name : str
        Of the shot: the beginning of the files' names.
    must_keep : bool
        Another process reads the values, so failing to keep one is an error; otherwise it is not.

    Attributes
    ----------
    used : dict of str to {"cached", "computed"}
        Where the value of each stage came from.
    not_kept : list of Finding
        CACHE_NOT_KEPT for each stage that the next run will compute again.
    """

    def __init__(self, folder: Path, name: str, *, must_keep: bool = False) -> None:
        self.used: dict[str, str] = {}
        self.not_kept: list[Finding] = []
        self._must_keep = must_keep
        self._folder = folder
        self._name = name

    def stage(
        self,
        name: str,
        inputs: object,
        given: Mapping[str, object],
        compute: Callable[[], ValueT],
    ) -> ValueT:
        """Return the value of a stage: kept from an earlier run, or computed and kept.

        Parameters
        ----------
        name : str
        inputs : values of the middle
            All that `compute` depends on.
        given : mapping of str to object
            Parts of the value that the caller has.
        compute : callable

        Raises
        ------
        OutputError
            If a value that must be kept cannot be.
        """
        try:
            key = content_digest((name, inputs, program()))
        except TypeError as error:  # a part from outside, of a term or format of another package
            self._leave_out(name, error)
            self.used[name] = "computed"
            return compute()
        place = self._folder / f"{self._name}.{name}.{key[:40]}.npz"
        for file in self._files(name, key, place):
            with suppress(UnpackError, OSError):
                stored_key, value = read_packed(file, _CLASSES, given)
                if stored_key == key:
                    self.used[name] = "cached"
                    kept: ValueT = value
                    return kept
        self.used[name] = "computed"
        computed = compute()
        try:
            self._forget(name, place)
            write_packed(place, (key, computed), _CLASSES, given)
        except (OutputError, OSError, TypeError) as error:
            self._leave_out(name, error)
        return computed

    def _leave_out(self, name: str, error: Exception) -> None:
        """Announce that a stage is not kept, which is an error where it must be."""
        if not self._must_keep:
            self.not_kept.append(finding("CACHE_NOT_KEPT", name, "{error}", error))
        elif isinstance(error, OutputError):
            raise error
        else:
            message = f"{name} of {self._name} cannot be kept in {self._folder}: {error}"
            raise OutputError(message) from error

    def _files(self, name: str, key: str, place: Path) -> list[Path]:
        """Return the files that may have the value: this shot's, then those of others."""
        ending = f".{name}.{key[:40]}.npz"
        if place.is_file() or not self._folder.is_dir():
            return [place]
        return [file for file in self._folder.iterdir() if file.name.endswith(ending)]

    def _forget(self, name: str, newest: Path) -> None:
        """Remove the oldest files of a stage, so that `_KEPT` remain."""
        prefix = f"{self._name}.{name}."
        if not self._folder.is_dir():
            return
        mine = [
            file
            for file in self._folder.iterdir()
            if file.name.startswith(prefix) and file.suffix == ".npz" and file != newest
        ]
        mine.sort(key=lambda file: file.stat().st_mtime_ns, reverse=True)
        for file in mine[_KEPT - 1 :]:
            file.unlink(missing_ok=True)
