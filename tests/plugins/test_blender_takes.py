"""A take of empties, on a stage as Blender exports it."""

from types import SimpleNamespace

import numpy as np
import pytest
from blender_stand_in import extension_parts
from pxr import Usd, UsdGeom


def test_frames_in_which_all_markers_rest_are_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.SetStartTimeCode(101)
    stage.SetEndTimeCode(120)
    stage.SetTimeCodesPerSecond(24)
    move = UsdGeom.Xform.Define(stage, "/chin").AddTranslateOp()
    # At rest to 105 and from 108 to 110: Blender leaves out samples that repeat the one before.
    for code, x in ((101, 0), (105, 0), (106, 1), (107, 2), (108, 3), (110, 3), (111, 4)):
        move.Set((x, 0, 0), code)
    with extension_parts(monkeypatch) as part:
        take = part("takes").StageTake(stage, [SimpleNamespace(name="chin", get=lambda _, n: n)])
    assert take.codes == list(range(101, 112))  # none after the last sample
    np.testing.assert_allclose(np.diff(take.times), 1 / 24)
    x = np.array(take.positions)[:, 0, 0] / UsdGeom.GetStageMetersPerUnit(stage)
    np.testing.assert_allclose(x, [0, 0, 0, 0, 0, 1, 2, 3, 3, 3, 4])


@pytest.mark.parametrize(("kind", "first"), [("EMPTIES", 1001), ("FILE", 1)])
def test_neutral_frames_count_from_where_the_take_begins(
    monkeypatch: pytest.MonkeyPatch, kind: str, first: int
) -> None:
    settings = SimpleNamespace(kept_setup=None, take_kind=kind, first_frame=1, neutral_start=-1)
    settings.neutral_end = -1
    scene = SimpleNamespace(usdface=settings, frame_start=1001, frame_current=1012)
    with extension_parts(monkeypatch) as part:
        operator = part("choose").USDFACE_OT_neutral_here()
        operator.extend = False
        assert operator.execute(SimpleNamespace(scene=scene)) == {"FINISHED"}
    assert settings.neutral_start == settings.neutral_end == 1012 - first
