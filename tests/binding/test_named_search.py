"""The example's named take on the example's head: names that are right, exchanged and wrong.

The rows of its mesh are 13 mm apart on the forehead.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from usdface.binding.proposal import Proposal, proposal_findings
from usdface.binding.propose import propose
from usdface.io.bind_file import read_bind
from usdface.io.takes.files import read_take
from usdface.io.usd.rig import read_rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup
from usdface.takes import MarkerTake

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MESH = read_rig(EXAMPLES / "head.usdc")[0].face()
TAKE = read_take(EXAMPLES / "performance.trc")[0]
assert isinstance(TAKE, MarkerTake)
TRUE = read_bind(EXAMPLES / "bind.json")[0].binding
PLACE = dict(zip(TRUE.markers, TRUE.points.tolist(), strict=True))


def proposed(names: tuple[str, ...], **given: int) -> Proposal:
    points = np.array(list(given.values()), dtype=np.int64)
    setup = RetargetSetup(Binding(tuple(given), points), neutral=(0, 29))
    return propose(replace(TAKE, names=names), MESH, setup)


def swapped(one: str, other: str) -> tuple[str, ...]:
    return tuple({one: other, other: one}.get(name, name) for name in TAKE.names)


def off(binding: Binding, names: tuple[str, ...]) -> np.ndarray:
    """Return how far bound markers are from where they truly are: (B,) [m]."""
    truth = {name: PLACE[own] for name, own in zip(names, TAKE.names, strict=True)}
    true = MESH.points[[truth[name] for name in binding.markers]]
    return np.linalg.norm(MESH.points[binding.points] - true, axis=1)


def exchanged() -> tuple[str, ...]:
    other = {"left": "right", "right": "left"}
    return tuple("_".join(other.get(word, word) for word in n.split("_")) for n in TAKE.names)


def codes(proposal: Proposal) -> list[str]:
    return [f.code for f in proposal_findings(proposal, "take.trc")]


def test_named_markers_land_on_their_places() -> None:
    proposal = proposed(TAKE.names)
    assert set(codes(proposal)) <= {"BIND_PROPOSED", "PLACE_UNSURE"}
    away = off(proposal.setup.binding, TAKE.names)
    assert len(away) >= len(TAKE.names) - 2 and np.median(away) < 0.004 and away.max() < 0.014


@pytest.mark.slow
def test_left_for_right_on_the_whole_face_is_asked() -> None:
    proposal = proposed(exchanged())
    assert codes(proposal).count("SIDES_EXCHANGED") == 1
    sided = {n for n in exchanged() if "left" in n or "right" in n}
    assert sided == set(proposal.exchanged) <= set(proposal.setup.unsure.markers)
    assert off(proposal.setup.binding, exchanged()).max() < 0.014  # those in the middle


@pytest.mark.slow
def test_one_given_vertex_decides_on_the_sides() -> None:
    names = exchanged()
    proposal = proposed(names, brow_right_inner=PLACE["brow_left_inner"])
    assert "SIDES_EXCHANGED" not in codes(proposal) and len(proposal.setup.unsure.markers) < 3
    assert off(proposal.setup.binding, names).max() < 0.014


@pytest.mark.slow
@pytest.mark.parametrize(
    ("one", "other"),
    [("brow_left_inner", "brow_right_inner"), ("brow_left_inner", "nasolabial_left")],
)
def test_a_name_that_the_geometry_contradicts_is_asked(one: str, other: str) -> None:
    proposal = proposed(swapped(one, other))
    assert {each.marker for each in proposal.contradicted} == {one, other}
    assert {one, other} <= set(proposal.setup.unsure.markers)
    assert codes(proposal).count("NAME_CONTRADICTED") == 2
    assert off(proposal.setup.binding, swapped(one, other)).max() < 0.014
    named = {each.marker: each.named for each in proposal.contradicted}
    assert named[one] == "left brow"


@pytest.mark.slow
def test_shuffled_names_are_not_believed() -> None:
    order = np.random.default_rng(0).permutation(len(TAKE.names))
    names = tuple(TAKE.names[i] for i in order)
    proposal = proposed(names)
    assert proposal.names_unused and "NAMES_UNUSED" in codes(proposal)
    assert 2 * len(proposal.setup.unsure.markers) > len(names) and "BIND_UNSURE" in codes(proposal)
