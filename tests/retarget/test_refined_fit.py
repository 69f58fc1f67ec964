"""The fit that a take bears out; places are refined in whole solves in test_face_fit.py."""

from dataclasses import replace

import numpy as np
import pytest
from skins import make_head

from usdface.blend_shapes.evaluator import BlendShapeEvaluator
from usdface.blend_shapes.vertex_evaluator import evaluator_of
from usdface.options import MapOptions
from usdface.retarget.face_fit import FaceFit, fit_face
from usdface.retarget.motion_evidence import MotionEvidence
from usdface.retarget.pose_and_weights import PoseAndWeights
from usdface.retarget.refined_fit import best_fit, refine_places

HEAD = make_head()
POSITIONS = HEAD.performed(np.zeros_like(HEAD.points))
EVIDENCE = MotionEvidence(HEAD.times, POSITIONS)


@pytest.fixture
def fit() -> FaceFit:
    """A fit of an equal face, with markers on their vertices for good."""
    evaluator, _ = evaluator_of(HEAD.mesh.shapes, HEAD.vertices)
    return fit_face(POSITIONS[0], HEAD.points, evaluator, MapOptions(), EVIDENCE, HEAD.surface)


def never(_: FaceFit | BlendShapeEvaluator) -> PoseAndWeights:
    raise AssertionError


def test_markers_on_their_vertices_for_good_are_not_refined(fit: FaceFit) -> None:
    refined = refine_places(
        fit, POSITIONS[0], MapOptions(), EVIDENCE, HEAD.surface,
        solve=never, sized=lambda shapes: shapes, moving_head=False,
    )  # fmt: skip
    assert refined is fit


def test_one_fit_is_the_best_without_a_solve(fit: FaceFit) -> None:
    assert best_fit([fit], never) == (fit, 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(("misfit", "chosen"), [(0.5, 1), (0.95, 1), (1.0, 0), (2.0, 0)])
def test_another_fit_is_taken_only_if_it_explains_the_motion_better(
    fit: FaceFit, misfit: float, chosen: int
) -> None:
    fits = [fit, replace(fit)]
    left = {id(fits[0]): 1e-4, id(fits[1]): 1e-4 * misfit}
    found, share = best_fit(fits, lambda fit: left[id(fit)])
    assert found is fits[chosen] and share == pytest.approx(misfit if chosen else 1.0)
