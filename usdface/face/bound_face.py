"""A bound face: a mesh with blend shapes, the markers bound to it, and its anatomy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from usdface.arrays import FloatArray, IntArray, freeze, frozen
from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.errors import InputError
from usdface.face.head_size import human_size
from usdface.face.layout import FaceLayout, find_layout
from usdface.face.lip_lid_contacts import find_lip_lid_contacts
from usdface.findings import Finding
from usdface.frozen_mapping import FrozenMapping
from usdface.options import CONTACT_TOLERANCE
from usdface.rigs import Mesh
from usdface.setup.expression import Expression
from usdface.setup.retarget_setup import RetargetSetup

__all__ = ["BoundFace", "bound_face"]


@dataclass(frozen=True, eq=False)
class BoundFace:
    """A mesh with S blend shapes and B markers on it; immutable.

    Attributes
    ----------
    mesh : Mesh
    markers : tuple of str, length B
        The bound markers.
    vertices : (B,) int64
        The vertex of the mesh that each is bound to.
    nose_tip : str
        Marker that features are measured to; "" = none.
    roles : mapping of str to str
        Role to marker.
    layout : FaceLayout
        Sides, regions, antagonists, lips and lids.
    rig_shapes : tuple of str
        Blend shapes of the whole rig; the mesh may have only some of them.
    """

    mesh: Mesh
    markers: tuple[str, ...]
    vertices: IntArray
    nose_tip: str = ""
    roles: Mapping[str, str] = field(default_factory=dict)
    layout: FaceLayout = field(default_factory=FaceLayout)
    rig_shapes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "vertices", dtype=np.int64)
        object.__setattr__(self, "roles", FrozenMapping(self.roles))

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Names of the mesh's blend shapes: S."""
        return self.mesh.shape_names

    @cached_property
    def vertex_of(self) -> Mapping[str, int]:
        """The vertex of each marker."""
        return FrozenMapping(dict(zip(self.markers, self.vertices.tolist(), strict=True)))

    @cached_property
    def nose(self) -> int:
        """Index of the nose tip among the markers.

        Raises
        ------
        InputError
            If there is none.
        """
        if self.nose_tip not in self.markers:
            raise InputError(
                f"no nose tip: there is no marker {self.nose_tip!r} among "
                f"{', '.join(self.markers)}; "
                'name the marker of the nose tip in the binding, "nose_tip"'
            )
        return self.markers.index(self.nose_tip)

    @property
    def midline(self) -> float:
        """X of the face's midline [m]: that of the nose tip, 0 without one."""
        there = self.nose_tip in self.markers
        return float(self.neutral[self.nose, 0]) if there else 0.0

    @cached_property
    def neutral(self) -> FloatArray:
        """Positions of the markers on the neutral face: (B, 3) [m]."""
        return frozen(self.mesh.points[self.vertices])

    @cached_property
    def offsets(self) -> FloatArray:
        """Displacement of the markers by each blend shape at weight 1: (S, B, 3) [m]."""
        return frozen(self.mesh.offsets_at(self.vertices))

    @property
    def evaluator(self) -> BlendShapeEvaluator:
        """Of the blend shapes at the markers, N = 3 B."""
        return self._evaluated[0]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Combination shapes that the evaluator ignores."""
        return self._evaluated[1]

    @cached_property
    def _evaluated(self) -> tuple[BlendShapeEvaluator, tuple[Finding, ...]]:
        evaluator, findings = evaluator_of(self.mesh.shapes, self.vertices)
        return evaluator, tuple(findings)

    def displacements(self, weights: FloatArray) -> FloatArray:
        """Return the displacements of the markers from neutral at weights (F, S): (F, B, 3) [m].

        Combination shapes follow their parents, whatever weight they are given.
        """
        moved = self.evaluator.displacements(self.evaluator.combined(weights))
        return np.asarray(moved.reshape(len(weights), *self.neutral.shape))

    def vertices_of(self, markers: Sequence[str]) -> IntArray:
        """Return the vertices of some markers: (len(markers),) int64."""
        return np.array([self.vertex_of[name] for name in markers], dtype=np.int64)

    def with_sorted_shapes(self) -> "BoundFace":
        """Return the face with its blend shapes in the order of their names.

        For random draws over blend shapes, which then do not depend on the order in a file.
        """
        shapes = tuple(sorted(self.mesh.shapes, key=lambda shape: shape.name))
        if shapes == self.mesh.shapes:
            return self  # with all that it has computed
        return replace(self, mesh=replace(self.mesh, shapes=shapes))

    @cached_property
    def size(self) -> float:
        """Size in human faces, by the distance between the eyes; 1 where it shows no lids.

        By the lids that the mesh shows, whatever the layout has: a system is designed before there
        is one.
        """
        return human_size(self.mesh)

    @property
    def tolerance(self) -> float:
        """Largest gap that a correction may open between lips or lids in contact [m]."""
        given = self.layout.tolerance
        return CONTACT_TOLERANCE * self.size if given is None else given

    def at_human_size(self) -> "BoundFace":
        """Return the face as large as a human one, for lengths that were found on people."""
        if self.size == 1.0:
            return self
        layout = replace(self.layout, tolerance=self.tolerance / self.size)
        return replace(self, mesh=self.mesh.scaled(1.0 / self.size), layout=layout)

    def with_layout(self, expressions: Sequence[Expression]) -> "BoundFace":
        """Return the face with the layout that is found on its mesh and `expressions`."""
        return replace(self, layout=find_layout(self.mesh, expressions, self.midline))

    def with_contacts(self) -> "BoundFace":
        """Return the face with the lips and lids of its mesh, where its layout has none."""
        layout = self.layout
        if len(layout.lids) or len(layout.lips):
            return self
        contacts = find_lip_lid_contacts(self.mesh)
        return replace(self, layout=replace(layout, lips=contacts.lips, lids=contacts.lids))


def bound_face(
    mesh: Mesh,
    setup: RetargetSetup,
    *,
    layout: FaceLayout | None = None,
    rig_shapes: tuple[str, ...] = (),
) -> BoundFace:
    """Return the face of a mesh with the markers of a setup on it.

    Parameters
    ----------
    mesh : Mesh
        The one that the setup's binding names.
    setup : RetargetSetup
        Fitted to the mesh (`usdface.face.fitted_setup.fit_setup`).
    layout : FaceLayout, optional
        As the shot has it; empty, if left out (`BoundFace.with_layout` finds one).
    rig_shapes : tuple of str, optional
        Blend shapes of the whole rig; those of the mesh, if left out.
    """
    binding = setup.binding
    return BoundFace(
        mesh,
        binding.markers,
        binding.points,
        setup.nose_tip,
        setup.roles,
        layout or FaceLayout(),
        rig_shapes or mesh.shape_names,
    )
