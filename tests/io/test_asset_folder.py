import os
from pathlib import Path

import pytest

from usdface.errors import InputError
from usdface.io.asset_folder import asset_folder, is_inside, read_file


def test_what_lies_inside_after_all_links(tmp_path: Path) -> None:
    folder = tmp_path / "asset"
    (folder / "below").mkdir(parents=True)
    (folder / "out").symlink_to(tmp_path)
    (folder / "back").symlink_to("../asset/below")
    (folder / "ring").symlink_to("ring")
    (tmp_path / "asset2").mkdir()
    for name in ("a", "below/a", "back/a", "below/../a", "out/asset/a", "ring/a", "."):
        assert is_inside(folder / name, [folder]), name
    for name in ("..", "../a", "../asset2/a", "out/a", "/etc/passwd", "a\0b"):
        assert not is_inside(folder / name, [folder, None]), name
        assert is_inside(folder / name, [folder, Path("/")]) == ("\0" not in name)
    assert not is_inside(folder, [])


def test_only_regular_files_of_a_size_are_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"12345")
    os.mkfifo(tmp_path / "pipe")
    assert read_file(tmp_path / "a", 5) == b"12345"
    with pytest.raises(InputError, match="larger"):
        read_file(tmp_path / "a", 4)
    for name in ("pipe", "none", ".", "/dev/zero", "a\0b"):
        with pytest.raises(InputError) as caught:
            read_file(tmp_path / name, 100)
        assert caught.value.code == "FILE_UNREADABLE"


def test_the_root_is_a_folder(tmp_path: Path) -> None:
    assert asset_folder("") is None and asset_folder(str(tmp_path)) == tmp_path
    with pytest.raises(InputError, match="is no folder"):
        asset_folder(str(tmp_path / "none"))
