"""Bindings that do not fit their rig or take."""

import pytest
from spoilt import Place, Refused, marker_take

from usdface.cli import main


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"marker": 3}, "'marker'"),
        ({"markers": {"nose": {"point": 195}}}, "vertices 0 to 194"),
        ({"markers": {"nose": {"point": -1}}}, "'nose'"),
        ({"markers": {"Nose": {"point": 1}, "Chin": {"point": 2}}, "nose_tip": "Nose"}, "Chin"),
        ({"mesh": "/Asset/Face/Kopf"}, "/Asset/Face/head"),
        ({"head": ["temple_l", "temple_r", "hat"]}, "'hat'"),
        ({"nose_tip": "nase"}, "'nase'"),
        ({"neutral": {"start": 0, "end": 400}}, "frames 0 to 39"),
        ({"neutral": {"start": 9, "end": 3}}, '"neutral"'),
        ({"solve": {"smoothness": -1}}, "smoothness"),
    ],
)
def test_a_binding_that_does_not_fit(
    place: Place, refused: Refused, changes: dict[str, object], message: str
) -> None:
    place.bind(**changes)
    assert message in refused(place.shot)


def test_no_binding_for_a_take_of_an_image(place: Place, refused: Refused) -> None:
    """Where the markers of a take in space sit is proposed."""
    marker_take(place, "usdface:dimension", "2d")
    command = place.shot
    del command[5:7]
    message = refused(command)
    assert "--bind" in message and "take.trc" in message


def test_too_few_markers_in_the_take(place: Place, refused: Refused) -> None:
    names = [f"m{i}" for i in range(20)] + ["nose", "chin", "brow"]
    marker_take(place, "usdface:markers:names", names)
    message = refused(place.process)
    assert "3 of the 23" in message and "at least 4" in message


def test_the_take_lost_the_rigid_markers(place: Place, refused: Refused) -> None:
    place.bind(head=["temple_l", "temple_r", "forehead"])
    assert main([str(a) for a in [*place.shot[:-1], place / "shot.usda"]]) == 0
    names = [n.replace("temple", "ear") for n in place.world.take.names]
    marker_take(place, "usdface:markers:names", names)
    message = refused(place.process)
    assert "temple_l" in message and "take.trc" in message


@pytest.mark.parametrize("space", ["character", "take"])
def test_the_take_lost_the_nose(place: Place, refused: Refused, space: str) -> None:
    if space != "character":
        place.replace("shot.usda", 'usdface:space = "character"', f'usdface:space = "{space}"')
    names = [n.replace("nose", "snout") for n in place.world.take.names]
    marker_take(place, "usdface:markers:names", names)
    assert "'nose'" in refused(place.process)
