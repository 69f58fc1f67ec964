from pathlib import Path

import pytest
from worlds import make_world

from usdface.errors import OutputError
from usdface.io.temporary_folder import temporary_folder
from usdface.pipeline import export_scene


def test_nothing_remains(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with temporary_folder() as folder:
        (folder / "a.bin").write_bytes(b"1")
        assert folder.parent == tmp_path
    assert not list(tmp_path.iterdir())


def test_a_full_or_missing_place_is_named_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    said = f"{tmp_path}: No space left on device; .*TMPDIR"
    with pytest.raises(OutputError, match=said), temporary_folder():
        raise OSError(28, "No space left on device")
    scene = make_world().write(tmp_path) / "rig.usda"
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    with pytest.raises(OutputError, match=r"a\.usdz: .*missing: No such file .*; .*TMPDIR"):
        export_scene(scene, tmp_path / "a.usdz")
