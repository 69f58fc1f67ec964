"""The curves that Blender's panel draws, against a stand-in for Blender."""

from types import SimpleNamespace

import numpy as np
import pytest
from blender_stand_in import extension_parts


def test_curves_of_a_file_that_was_open_before_are_not_shown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = SimpleNamespace(result="/a/shot.usdface.usda", first_frame=1)
    scene = SimpleNamespace(name="Scene", usdface=settings)
    take = SimpleNamespace(rate=24.0)
    shot = SimpleNamespace(take=take, system=None)
    played = SimpleNamespace(shot=shot, emotions={}, firing=(), residual=np.zeros(3))
    with extension_parts(monkeypatch) as part:
        last = part("last_result")
        last.keep(scene, played)
        assert last.is_kept(scene)
        settings.result = "/b/shot.usdface.usda"  # another file, whose scene has the same name
        assert not last.is_kept(scene)
