"""Images of a marked face mapped to a character: `usdface bench papers --images`."""

from dataclasses import replace
from pathlib import Path

from usdface.binding.resolve_binding import resolve_binding
from usdface.errors import InputError
from usdface.face.bound_face import bound_face
from usdface.face.fitted_setup import fit_setup
from usdface.findings import Finding
from usdface.io.bind_file import read_bind
from usdface.io.images.footage import read_image_take
from usdface.io.images.sequence import is_pattern, may_be_images
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.files import read_take
from usdface.options import BindOptions, TakeOptions
from usdface.papers.image_points import ImagePoints, compare_ways
from usdface.setup.assumed_mesh import assumed_mesh
from usdface.takes import MarkerTake, WeightsTake

__all__ = ["compare_images"]


def compare_images(
    images: Path,
    *,
    rig: Path,
    bind: Path,
    options: TakeOptions,
    reference: Path | None,
    test_frame: int | None,
) -> tuple[ImagePoints, list[Finding]]:
    """Carry the dots of a film over to a character by the RBF paper's map, and by default.

    Parameters
    ----------
    images : Path
        A folder or pattern of images, or a 2D take made of them.
    rig : Path
        The character.
    bind : Path
        Places of the markers on it, and neutral frames.
    options : TakeOptions
        Of the images; its `names` call the dots as the binding does. The others are
        named by where the bound vertices lie.
    reference : Path, optional
        A take of the performed weights, in the time of the images.
    test_frame : int, optional
        As of `compare_ways`.

    Raises
    ------
    InputError
        If a file is not one of these, or they do not belong together.
    """
    character, findings = read_rig_file(rig)
    given, found = read_bind(bind)
    findings = [*findings, *found]
    take: MarkerTake | WeightsTake
    if is_pattern(images) or may_be_images(images):
        take, found = read_image_take(images, replace(options, bind=bind, rig=rig))
    else:
        take, found = read_take(images, replace(options, bind=None, rig=None))
    findings += found
    if not isinstance(take, MarkerTake) or take.dimension != 2:
        raise InputError(
            f"{images} is no take of an image; expected images of painted dots, or a 2D take",
            "TAKE_KIND_WRONG",
        )
    true: WeightsTake | None = None
    if reference is not None:
        curves, found = read_take(reference)
        findings += found
        if not isinstance(curves, WeightsTake):
            raise InputError(
                f"{reference} is no take of weights; expected blend shape weights over time",
                "TAKE_KIND_WRONG",
            )
        true = curves
    resolved = resolve_binding(character, take, given, options=BindOptions())
    if resolved.mesh_assumed and not any(f.code == "MESH_ASSUMED" for f in findings):
        findings.append(assumed_mesh(resolved.mesh, str(bind)))
    setup, found = fit_setup(resolved.setup, resolved.mesh, take)
    findings += found
    face = bound_face(resolved.mesh, setup)
    result, found = compare_ways(take, face, setup, reference=true, test_frame=test_frame)
    return result, findings + found
