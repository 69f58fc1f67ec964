import pytest

from usdface.facs.movements import MOVEMENTS
from usdface.facs.shape_claims import Claim, claims_of


@pytest.mark.parametrize(
    "name, expected",
    [
        ("mouthSmileLeft", "AU12L"),
        ("mouthSmile_R", "AU12R"),
        ("browInnerUp", "AU1"),
        ("eyebrows-left-inner-up", "AU1L"),
        ("eyeLookInRight", "AU61R"),
        ("eyeLookOut_R", "AU62R"),
        ("jawRight", "AU30R"),
        ("mouthLeft", "mouth left"),
        ("AU12", "AU12"),
        ("au04_L", "AU4L"),
        ("FACS_AU1_right", "AU1R"),
        ("AU27", "AU26"),
        ("AU30_L", "AU30L"),
        ("blinkLeft", "AU43L"),
        ("mouthPressLeft", "AU24L AU23L"),
        ("AU28", "AU28 lower AU28 upper"),
    ],
)
def test_names_in_every_spelling(name: str, expected: str) -> None:
    assert " ".join(str(claim) for claim in claims_of([name])[name]) == expected


@pytest.mark.parametrize("name", ["horns", "12", "AU99", "tongueOut", "viseme_aa", ""])
def test_names_that_tell_no_unit(name: str) -> None:
    assert not claims_of([name])


def test_every_claim_is_a_movement_with_a_title(judged_head) -> None:
    claims = claims_of(judged_head.rig.shape_names)
    assert len(claims) == 51
    for claim in (claim for these in claims.values() for claim in these):
        assert claim.movement in MOVEMENTS and claim.title
    assert Claim("12", "L").title == "lip corner puller, left"
