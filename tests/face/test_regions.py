from dataclasses import replace

import pytest
from slits import slit_face

from usdface.face.lip_lid_contacts import LipLidContacts, find_lip_lid_contacts
from usdface.face.regions import shape_regions
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
