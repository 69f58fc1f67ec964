"""A setup fitted to a mesh and a take."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import World, make_world

from usdface.errors import InputError
from usdface.face.fitted_setup import fit_setup
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup


@pytest.fixture(scope="module")
def world() -> World:
    return make_world()


def test_the_mesh_is_named_and_the_foremost_marker_is_the_nose(world: World) -> None:
    mesh = world.rig.meshes[0]
    fitted, findings = fit_setup(world.setup(), mesh, world.take)
    assert fitted.binding.mesh == "head" and fitted.nose_tip == "nose"
    assert [(f.code, f.where) for f in findings] == [("NOSE_TIP_ASSUMED", "nose")]
    again, findings = fit_setup(fitted, mesh, world.take)
    assert findings == [] and again.nose_tip == "nose"


def test_a_marker_that_is_named_so_is_the_nose_tip(world: World) -> None:
    """Though another one is further in front."""
    mesh = world.rig.meshes[0]
    foremost, *others = sorted(world.points.values(), key=lambda vertex: -mesh.points[vertex, 2])
    binding = Binding(("lip", "NoseTip", "chin"), np.array([foremost, *others[:2]]))
    fitted, findings = fit_setup(RetargetSetup(binding, neutral=(0, 3)), mesh)
    assert (fitted.nose_tip, findings) == ("NoseTip", [])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"nose_tip": "nase"}, "'nase' is not among the bound markers"),
        ({"nose_tip": "nase"}, "; did you mean nose?"),
        ({"head": "markers", "head_markers": ("a", "b", "chin")}, "no marker 'a', 'b'"),
        ({"neutral": (0, 40)}, "frames 0 to 39"),
        ({"neutral_weights": {"jawopen": 0.2}}, "'jawopen', a blend shape the bound mesh has not"),
        ({"binding": Binding(("x", "y"), np.array([1, 2]))}, "no bound marker is in the take"),
        ({"binding": Binding(("nose",), np.array([195]))}, "vertices 0 to 194"),
        ({"binding": Binding(("nose",), np.array([-1]))}, "vertex -1"),
    ],
)
def test_a_setup_must_fit_rig_and_take(
    world: World, changes: dict[str, object], message: str
) -> None:
    setup = world.setup() if "binding" not in changes else None
    with pytest.raises(InputError) as caught:
        setup = world.setup(**changes) if setup else RetargetSetup(**changes)  # type: ignore[arg-type]
        fit_setup(setup, world.rig.meshes[0], world.take)
    assert message in str(caught.value)


def test_an_assumed_neutral_is_a_frame_that_shows_the_markers(world: World) -> None:
    """Where the labels begin late; one late marker is no reason to take a later frame."""
    mesh = world.rig.meshes[0]
    positions = world.take.positions.copy()
    positions[:, 3] = np.nan
    positions[:2], positions[2, 4:] = np.nan, np.nan
    late = replace(world.take, positions=positions)
    fitted, (found, _) = fit_setup(world.setup(neutral_assumed=True), mesh, late)
    assert fitted.neutral == (3, 3)
    assert found.code == "NEUTRAL_ASSUMED" and "frame 3 is taken" in found.message
    one = world.take.positions.copy()
    one[:30, 5] = np.nan
    fitted, (found, _) = fit_setup(
        world.setup(neutral=(0, 0), neutral_assumed=True), mesh, replace(world.take, positions=one)
    )
    assert fitted.neutral == (0, 0) and "the first frame is taken" in found.message


def test_a_rig_alone_has_no_frame_that_could_be_neutral(world: World) -> None:
    """As of `usdface markers`, which has no take."""
    setup = world.setup(neutral_assumed=True)
    assert "NEUTRAL_ASSUMED" not in {f.code for f in fit_setup(setup, world.rig.meshes[0])[1]}
