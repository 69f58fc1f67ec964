from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ict_face import ict_mesh, landmarks
from slits import slit_face
from worlds import make_world

from usdface.face.lip_lid_contacts import LipLidContacts, find_lip_lid_contacts
from usdface.face.regions import REGIONS, regions_of, shape_regions
from usdface.rigs import BlendShape

FACE = slit_face()
SEAMS = find_lip_lid_contacts(FACE)
NO_SEAMS = LipLidContacts(SEAMS.lips[:0], SEAMS.lids[:0])


def expected(name: str) -> str:
    return "brows" if "brow" in name else "eyes" if "eye" in name else "mouth"


def test_names_of_action_units_say_where_a_shape_belongs():
    regions = shape_regions(FACE, NO_SEAMS)
    placed = {name: region for region, names in regions.items() for name in names}
    assert placed.keys() == set(FACE.shape_names)
    assert all(region == expected(name) for name, region in placed.items())


def test_other_names_are_placed_by_what_they_move():
    renamed = tuple(
        BlendShape(f"m{i:02d}", s.indices, s.offsets) for i, s in enumerate(FACE.shapes)
    )
    regions = shape_regions(replace(FACE, shapes=renamed), SEAMS)
    placed = {name: region for region, names in regions.items() for name in names}
    for shape, original in zip(renamed, FACE.shapes, strict=True):
        assert placed[shape.name] == expected(original.name), original.name


@pytest.mark.parametrize("seams", [SEAMS, NO_SEAMS])
def test_a_shape_is_in_one_region_at_most(seams):
    names = [name for listed in shape_regions(FACE, seams).values() for name in listed]
    assert len(names) == len(set(names))


@pytest.mark.parametrize(
    ("name", "region", "gain"),
    [
        ("cheekPuff", "cheeks", "mouth"),
        ("cheekSquint_L", "cheeks", "eyes"),
        ("cheekRaiser_R", "cheeks", "eyes"),
        ("noseSneerLeft", "nose", "mouth"),
        ("eyebrows-left-down", "brows", "brows"),
        ("eye-left-slit", "eyes", "eyes"),
        ("mouthShrugLower", "mouth", "mouth"),
        ("mouthSlide_L", "mouth", "mouth"),
        ("Lid_Upper_L", "eyes", "eyes"),
        ("jawOpen", "jaw", "mouth"),
        ("AU06_L", "cheeks", "eyes"),
        ("AU26", "jaw", "mouth"),
        ("AU4", "brows", "brows"),
    ],
)
def test_one_list_says_where_a_shape_is_and_whose_gain_it_has(name, region, gain):
    mesh = replace(FACE, shapes=(replace(FACE.shapes[0], name=name),))
    assert set(regions_of(mesh, np.arange(5))) == {region} <= set(REGIONS)
    assert shape_regions(mesh, NO_SEAMS)[gain] == (name,)


WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
AT = np.array(list(WORLD.points.values()))


def test_markers_are_in_the_region_of_the_shapes_around_them() -> None:
    found = dict(zip(WORLD.points, regions_of(MESH, AT), strict=True))
    for region, names in {
        "brows": ("forehead", "brow_in_l", "brow_out_r"),
        "eyes": ("lid_l", "lid_r"),
        "mouth": ("lip_upper", "lip_lower", "corner_l", "corner_r"),
        "jaw": ("chin",),
    }.items():
        assert {found[name] for name in names} == {region}


def test_the_landmarks_of_a_real_face_are_where_they_are_said_to_be(shared_data: Path) -> None:
    """The 68 landmarks come in groups (iBUG): jaw line, brows, nose, eyes, mouth."""
    mesh = ict_mesh(shared_data)
    found = np.array(regions_of(mesh, landmarks(shared_data)))
    assert (found[17:27] == "brows").all()
    assert (found[31:36] == "nose").all()
    assert (found[36:48] == "eyes").all()
    assert (found[48:68] == "mouth").all()
    assert (found[4:13] == "jaw").all()


def test_a_face_whose_shapes_have_no_telling_names_is_one_region() -> None:
    named = (replace(s, name=f"s{k}") for k, s in enumerate(MESH.shapes))
    mesh = replace(MESH, shapes=tuple(named))
    assert set(regions_of(mesh, AT)) == {"face"}
    empty = replace(MESH, shapes=(BlendShape("jawOpen", np.zeros(0, int), np.zeros((0, 3))),))
    assert set(regions_of(empty, AT)) == {"face"}
