"""The files that `process` writes beside its layers: checked before any work, and written."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from usdface.clips import Clip
from usdface.errors import InputError
from usdface.figures.picture import check_picture
from usdface.findings import Finding
from usdface.hooks import Hook, run_hooks
from usdface.io.atomic import StrPath
from usdface.io.generation import Generation
from usdface.io.gltf.external_files import check_gltf_name
from usdface.io.inputs import check_outputs, files_read, files_written
from usdface.io.layer_paths import layer_paths
from usdface.io.overwrite_protection import OutputKind, check_replaced
from usdface.io.usd.animation_write import animation_path
from usdface.io.usd.character_meshes import report_left_out
from usdface.io.usd.generation import layer_generation
from usdface.io.usd.layers import write_layers
from usdface.io.usd.own_motion import own_joints, report_unmoved
from usdface.io.usd.rigid_animation import merge_joint_takes
from usdface.io.usd.save_layers import check_usd_name
from usdface.io.usd.shot import StagedShot
from usdface.io.usd.stage import open_layer, open_stage
from usdface.io.usd.stronger_opinions import check_weights_shown
from usdface.options import DeliverOptions
from usdface.result import Result
from usdface.shot.shot import ShotResult

__all__ = ["ProcessOutputs", "process_outputs", "weight_deviations"]


@dataclass(frozen=True, slots=True)
class ProcessOutputs:
    """The output files of `process`; None: not written.

    `root` is that of the result as it was given; None: beside the shot, or in place.
    """

    root: Path | None
    gltf: Path | None
    figure: Path | None
    sheet: Path | None
    deliver: Path | None
    in_place: bool

    @property
    def beside(self) -> tuple[Path, ...]:
        """The files beside layers and glTF."""
        return tuple(filter(None, (self.figure, self.sheet, self.deliver)))

    def root_of(self, shot: Path) -> Path:
        """Return the file to open: the shot itself where the layers are put into it."""
        return shot if self.in_place else layer_paths(shot, self.root).root

    def others(self, read: Iterable[Path]) -> list[Path]:
        """Return the outputs beside the layers, with the files of the glTF."""
        scene = files_written(self.gltf, read) if self.gltf else ()
        return [*scene, *self.beside]

    def check(self, shot: Path, overwrite: bool) -> dict[Path, Path]:
        """Refuse files that must not be replaced; return those that are read.

        Layers that an earlier run put into the shot itself are not read, but written anew.

        Raises
        ------
        InputError
            If the root is not named as a USD file, or the shot is a result and no root is named:
            it would be solved again, beside itself.
        OutputError
        """
        beside = self.root is None and not self.in_place
        if beside and layer_generation(open_layer(shot)):
            raise InputError(
                f"{shot} is a result of `usdface process`; process the shot that it is of, or name "
                "another output (-o)"
            )
        ours = layer_paths(shot, self.root)
        root = None if self.in_place else ours.root
        read = files_read(shot, apart=ours.layers)
        check_outputs([root, *ours.layers, self.gltf, *self.beside], read)
        written: list[tuple[Path | None, OutputKind]] = [(root, "result")]
        written += [(layer, "layer") for layer in ours.layers]
        written += [(self.gltf, "glTF"), (self.deliver, "deliverable")]
        check_replaced(written, overwrite, within=root or shot)
        return read

    def check_shown(self, staged: StagedShot) -> None:
        """Refuse to put layers into a shot that hides their weights.

        Raises
        ------
        OutputError
        """
        if self.in_place:
            check_weights_shown(animation_path(staged.prims), staged.stage.GetRootLayer())

    def check_delivery(self, staged: StagedShot, options: DeliverOptions) -> None:
        """Refuse a deliverable of a range without a frame of the take."""
        if self.deliver is None:
            return
        from usdface.io.usd.deliverable import check_delivery  # only here: most runs write none

        check_delivery(staged.stage, self.deliver, staged.codes, options)

    def write_gltf(
        self,
        staged: StagedShot,
        retargeted: ShotResult,
        hooks: Sequence[Hook],
        read: Iterable[Path],
        generation: Generation,
    ) -> list[Finding]:
        """Write the character and its final weights as glTF, if it is wanted."""
        if self.gltf is None:
            return []
        from usdface.io.gltf.write import write_gltf  # only here: most runs write none
        from usdface.io.head_clip import head_clip

        rig, times = staged.shot.rig, retargeted.solved.times
        head, eyes, carrier = retargeted.head_motion, retargeted.eye_motions, staged.prims.head
        takes = []
        if carrier is not None and (head is not None or eyes):
            rig, joints = head_clip(rig, carrier.joint, head, times, eyes)
            takes.append(joints)
        moved: set[str] = set()
        if rig.skeleton is staged.shot.rig.skeleton:  # else a joint for the whole head is all of it
            moved |= {name for take in takes for name in take.joints}
            own = own_joints(staged, times, apart=moved)
            takes += [own] if own is not None else []
            moved |= set(own.joints) if own is not None else set()
        clip = Clip("take", retargeted.weights, merge_joint_takes(takes))
        (rig, clips), findings = run_hooks(hooks, "before_export", (rig, (clip,)))
        findings += report_left_out(staged) + report_unmoved(staged, moved)
        return findings + write_gltf(rig, self.gltf, clips, read=read, metadata=generation)

    def write_layers(
        self,
        shot: Path,
        staged: StagedShot,
        reported: Result[ShotResult],
        generation: Generation,
    ) -> list[Path]:
        """Write the layers of a result; return their files, the one to open first."""
        return write_layers(
            shot, staged, reported.value, root=self.root, in_place=self.in_place,
            verdict=reported.verdict, deviations=weight_deviations(reported),
            generation=generation["generation"],
        )  # fmt: skip

    def draw(self, retargeted: ShotResult, reported: Result[ShotResult]) -> None:
        """Draw figure and sheet, if they are wanted."""
        if self.figure:
            from usdface.figures.take import write_take_figure  # only here: most runs draw none

            write_take_figure(retargeted, reported.details, self.figure)
        if self.sheet:
            from usdface.figures.sheet import write_sheet

            write_sheet(retargeted, self.sheet)

    def write_deliverable(
        self, root: Path, staged: StagedShot, options: DeliverOptions
    ) -> list[Finding]:
        """Write the deliverable of a result, as USD composes it, if it is wanted."""
        if self.deliver is None:
            return []
        from usdface.io.usd.deliverable import write_deliverable  # only here: most runs write none

        return write_deliverable(
            open_stage(root), animation_path(staged.prims), self.deliver, staged.codes, options
        )


def weight_deviations(reported: Result[ShotResult]) -> dict[str, float]:
    """Return the standard deviation of the weight of each blend shape; {} if not known."""
    return dict(reported.details.get("confidence", {}).get("standard_deviation", {}))


def process_outputs(
    *,
    output: StrPath | None,
    gltf: StrPath | None,
    figure: StrPath | None,
    sheet: StrPath | None,
    deliver: StrPath | None,
    in_place: bool,
) -> ProcessOutputs:
    """Return the outputs of `process`, whose names end as their formats do.

    Raises
    ------
    InputError
        If a picture is not named as one, or cannot be drawn.
    OutputError
        If the glTF or the deliverable is not named as one.
    """
    places = (Path(p) if p else None for p in (output, gltf, figure, sheet, deliver))
    root, scene, picture, faces, clean = places
    named = ProcessOutputs(root, scene, picture, faces, clean, in_place)
    check_picture(named.figure)
    check_picture(named.sheet)
    if named.gltf:
        check_gltf_name(named.gltf)
    if named.deliver:
        check_usd_name(named.deliver)
    return named
