"""On an open stage `apply` does what `process` writes to files."""

import numpy as np
import pytest
from processed import Done, digests
from pxr import Sdf, Usd
from worlds import animation_of

from usdface.errors import OutputError
from usdface.io.usd.animation_write import _is_result
from usdface.pipeline import apply


def test_an_open_stage_gets_what_process_writes(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    result = apply(stage)
    assert result.written == () and result.summary["frames"] == 40
    written, applied = animation_of(done.root), animation_of(stage)
    np.testing.assert_array_equal(applied.weights, written.weights)
    np.testing.assert_allclose(applied.times, written.times, atol=1e-9)
    both = Usd.Stage.Open(str(done.root)), stage
    for path in ("/Shot/Fuzzy.usdface:emotion:joy", "/Shot/Retarget.usdface:residual"):
        written, applied = (s.GetAttributeAtPath(path) for s in both)
        curves = [[attribute.Get(c) for c in range(40)] for attribute in (written, applied)]
        np.testing.assert_allclose(*curves, atol=1e-6)
    assert digests(done.folder).items() >= done.before.items()


def test_apply_again_changes_nothing(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    apply(stage)
    first = stage.GetSessionLayer().ExportToString()
    apply(stage)
    assert stage.GetSessionLayer().ExportToString() == first


def test_every_attribute_of_a_result_is_known_as_one(done: Done) -> None:
    """Else that of an earlier run stays beside a result that lacks it."""
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    stage.SetEditTarget(stage.GetSessionLayer())
    apply(stage)
    found: set[str] = set()
    stage.GetSessionLayer().Traverse("/", lambda path: found.add(path.name))
    own = {name for name in found if name.startswith("usdface:")}
    assert len(own) > 10
    assert {name for name in own if not _is_result(name)} == set(), "_RESULTS lacks them"


@pytest.mark.slow
def test_apply_says_when_the_edit_target_cannot_take_it(done: Done) -> None:
    stage = Usd.Stage.Open(str(done.folder / "shot.usda"))
    foreign = Sdf.Layer.FindOrOpen(str(done.folder / "rig.usda"))
    session = stage.GetSessionLayer()
    session.SetPermissionToEdit(False)
    reference = stage.GetPrimAtPath("/Shot/Character").GetPrimIndex().rootNode.children[0]
    for target in (Usd.EditTarget(session), Usd.EditTarget(foreign, reference)):
        stage.SetEditTarget(target)
        with pytest.raises(OutputError, match="edit target"):
            apply(stage)
