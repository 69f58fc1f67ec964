from dataclasses import replace

import numpy as np
import pytest
from processed import Done
from pxr import Usd

from usdface.closure.lid_apertures import lid_apertures_of
from usdface.face.regions import regions_of
from usdface.io.usd.played_shot import read_played_shot
from usdface.page.clip_data import TICKS_PER_SECOND
from usdface.page.rule_data import rule_data
from usdface.page.shot_data import carrier_of, gap_curves, shot_data
from usdface.shot.played_shot import PlayedShot


@pytest.fixture(scope="module")
def played(done: Done) -> PlayedShot:
    return read_played_shot(Usd.Stage.Open(str(done.root)), "the shot")[0]


def test_times_weights_and_residuals_are_those_of_the_shot(played: PlayedShot) -> None:
    shapes = played.rig.shape_names
    data = shot_data(played, shapes, played.rig.meshes)
    (clip,) = data["clips"]
    np.testing.assert_allclose(clip["ticks"] / TICKS_PER_SECOND, played.shot.take.times, atol=1e-5)
    expected = played.corrected.reordered(shapes).weights
    np.testing.assert_allclose(clip["weights"]["corrected"].values, expected)
    residual = data["residual"]["all_mm"].values
    np.testing.assert_allclose(residual, 1000 * played.residual)
    assert data["face"]["mesh"] == [m.path for m in played.rig.meshes].index(played.shot.mesh.path)
    assert len(data["regions"]) == len(data["deviations"]) == len(shapes)
    assert {"brows", "eyes", "mouth"} <= set(data["regions"])


def test_where_no_marker_is_seen_there_is_no_residual(played: PlayedShot) -> None:
    distances, residual = played.distances.copy(), played.residual.copy()
    distances[3], residual[3] = np.nan, 0.0
    regions = regions_of(played.shot.face.mesh, played.shot.face.vertices_of(played.markers))
    mouth = np.array(regions) == "mouth"
    distances[5, mouth] = np.nan
    changed = replace(played, distances=distances, residual=residual)
    data = shot_data(changed, played.rig.shape_names, played.rig.meshes)["residual"]
    assert np.flatnonzero(np.isnan(data["all_mm"].values)).tolist() == [3]
    assert np.flatnonzero(np.isnan(data["regions_mm"]["mouth"].values)).tolist() == [3, 5]


def test_gaps_are_those_of_the_lids(played: PlayedShot) -> None:
    face = played.shot.face
    curves = {gap["name"]: gap for gap in gap_curves(played, face)}
    lids = lid_apertures_of(face, played.corrected.names)
    assert {f"{eye} eye" for eye in lids} <= set(curves)
    for eye, own in lids.items():
        least = own.least(played.corrected.weights)
        np.testing.assert_allclose(
            curves[f"{eye} eye"]["corrected"]["least_mm"].values, 1000 * least
        )


def test_degrees_of_conditions_are_memberships_and_lengths_are_millimetres(
    played: PlayedShot,
) -> None:
    data, evaluation = rule_data(played), played.evaluation()
    assert data is not None and evaluation is not None
    degrees, system = data["degrees"].values, played.shot.system
    for rule, shown in zip(system.fuzzy.rules, data["rules"], strict=True):
        for condition, column in zip(rule.propositions, shown["conditions"], strict=True):
            expected = evaluation.memberships[condition]
            np.testing.assert_allclose(degrees[:, column], expected)
            entry = data["conditions"][column]
            assert entry["marker"] in played.shot.setup.binding.markers
            assert entry["term"].endswith(condition.term)
    np.testing.assert_allclose(data["inputs_mm"].values, 1000 * played.unit * played.inputs)


def test_no_joint_carries_a_face_without_skin(played: PlayedShot) -> None:
    joint = carrier_of(played, played.shot.face)
    assert joint == -1 or played.rig.skeleton is not None
