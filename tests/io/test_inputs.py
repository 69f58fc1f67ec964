import os
from pathlib import Path

import pytest

from usdface.errors import OutputError
from usdface.io.inputs import among, check_outputs, files_read, files_written, first_free


def test_a_file_is_known_by_any_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a").write_text("")
    os.link(tmp_path / "a", tmp_path / "hard")
    (tmp_path / "soft").symlink_to("a")
    (tmp_path / "folder").symlink_to("sub")
    monkeypatch.chdir(tmp_path)
    known = among([Path("sub/../a"), Path("none"), Path("a\0b")])
    for name in ("a", "hard", "soft", "./a", "folder/../a", str(tmp_path / "a")):
        assert known(Path(name)), name
    assert not any(known(Path(name)) for name in ("none", "sub", "a\0b"))


def test_the_line_says_who_reads(tmp_path: Path) -> None:
    take, labels = tmp_path / "take.csv", tmp_path / "labels.csv"
    take.write_text("")
    labels.write_text("take,start_frame,end_frame,emotion\ntake.csv,9,12,joy\n")
    read = files_read(None, labels=labels)
    assert read == {labels: labels, take: take}
    with pytest.raises(OutputError, match=r"labels.csv is an input and would be overwritten"):
        check_outputs([None, labels], read)
    with pytest.raises(OutputError, match=r"take.csv is read by .*shot.usda and would be"):
        check_outputs([take], {take: tmp_path / "shot.usda"})
    check_outputs([tmp_path / "new.csv"], read)


def test_a_gltf_has_its_bin(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(b"")
    read = {tmp_path / "a.bin": tmp_path / "scene.usda"}
    with pytest.raises(OutputError, match=r"a.bin is read by"):
        check_outputs([tmp_path / "a.gltf"], read)
    check_outputs([tmp_path / "a.glb"], read)


def test_names_that_are_read_are_passed_by(tmp_path: Path) -> None:
    (tmp_path / "0").write_bytes(b"kept")
    (tmp_path / "1").write_bytes(b"same")
    taken = among([tmp_path / "0", tmp_path / "1"])
    assert first_free(tmp_path, "012", b"same", taken) == ("1", True)
    assert first_free(tmp_path, "012", b"else", taken) == ("2", False)
    assert first_free(tmp_path, "012", b"else", among([])) == ("0", False)


def test_a_result_is_listed_without_what_was_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "old.png").write_bytes(b"")
    (tmp_path / "new.png").write_bytes(b"")
    (tmp_path / "a.gltf").write_text('{"images": [{"uri": "old.png"}, {"uri": "new.png"}]}')
    monkeypatch.chdir(tmp_path)
    written = files_written(Path("a.gltf"), [Path("old.png")])
    assert written == (Path("a.gltf"), Path("new.png"))


def test_pictures_beside_the_meshes_of_a_folder_make_it_no_film(tmp_path: Path) -> None:
    (tmp_path / "neutral.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "skin.png").write_bytes(b"")
    assert tmp_path / "neutral.obj" in files_read(tmp_path)


def test_every_image_of_a_film_is_read(tmp_path: Path) -> None:
    images = {tmp_path / f"face.{number:04d}.png" for number in (1, 2, 4)}
    for image in images:
        image.write_bytes(b"")
    assert set(files_read(tmp_path)) == set(files_read(tmp_path / "face.####.png")) == images


def test_a_take_beside_the_images_that_it_was_made_of_is_not_read_with_them(tmp_path: Path) -> None:
    """`usdface take . -o take.usdc`, the second time."""
    for name in ("face.1.png", "take.usdc", "names.csv"):
        (tmp_path / name).write_bytes(b"")
    check_outputs([tmp_path / "take.usdc"], files_read(tmp_path))
    with pytest.raises(OutputError, match="would be overwritten"):
        check_outputs([tmp_path / "face.1.png"], files_read(tmp_path))
