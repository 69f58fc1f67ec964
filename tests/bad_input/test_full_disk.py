"""A disk that fills up while a result is written: one line, and the last result is still there."""

import os
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from spoilt import Place, Refused, wide_csv

from usdface.cli import main
from usdface.io.usd.rig import read_rig
from usdface.io.usd.rig_write import write_rig
from usdface.materials import Material, Texture

Command = list[object]


def commands(place: Place) -> dict[str, Command]:
    """Every command that writes, by the kind of what it writes; over files of any content."""
    csv = wide_csv(place, [f"{k / 60},1,2,3,4,5,{k % 7}" for k in range(400)])
    scene = place / "scene.usda"
    written = {
        "rig": ["rig", scene, "-o", place / "out/rig.usda"],
        "take": ["take", csv, "-o", place / "out/take.usda"],
        "shot": [
            *place.shot[:-1],
            place / "out/shot.usda",
            "--write-bind",
            place / "out/b.json",
        ],
        "process": [*place.process, "-o", place / "out/done.usda", "--gltf", place / "out/a.glb"],
        "glb": ["export", scene, "-o", place / "out/face.glb"],
        "gltf": ["export", scene, "-o", place / "out/face.gltf"],
        "usdz": ["export", scene, "-o", place / "out/face.usdz"],
        "fuzzy": ["fuzzy", "paper", "-o", place / "out/paper.usda"],
        "import": ["import", place / "face.glb", "-o", place / "out/face.usdc"],
    }
    return {name: [*command, "--overwrite"] for name, command in written.items()}


@pytest.fixture
def written(place: Place) -> Place:
    """A place where the previous results of all commands lie in a folder `out`."""
    rng = np.random.default_rng(0)
    noise = b"\x89PNG\r\n\x1a\n" + rng.integers(0, 256, 50_000, np.uint8).tobytes()
    rig = read_rig(place / "rig.usda")[0]
    skin = Material("Skin", base_color_texture=Texture(data=noise, suffix=".png"))
    meshes = tuple(replace(mesh, material="Skin", subsets=()) for mesh in rig.meshes)
    write_rig(replace(rig, meshes=meshes, materials=(skin,)), place / "scene.usda")
    assert main(["export", str(place / "scene.usda"), "-o", str(place / "face.glb")]) == 0
    for command in commands(place).values():
        assert main([str(a) for a in command]) == 0
    for file in (place / "out").rglob("*"):  # so that a result that is replaced can be told
        if file.is_file():
            file.write_bytes(b"the last result" + bytes(100))
    return place


@pytest.fixture
def largest(written: Place) -> Iterator[Callable[[int], None]]:
    """A function that lets no file of this process grow beyond a size; Python ignores SIGXFSZ."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.slow
@pytest.mark.parametrize("size", [pytest.param(1000, marks=pytest.mark.slow), 3000])
def test_files_that_cannot_grow(
    written: Place, refused: Refused, largest: Callable[[int], None], size: int
) -> None:
    for name, command in commands(written).items():
        largest(size)
        try:
            message = refused(command)
        finally:
            largest(resource.RLIM_INFINITY)
        assert "cannot write" in message and "File too large" in message, name


@pytest.fixture
def disk(written: Place) -> Iterator[Path]:
    """A file system of its own in the folder `out`."""
    kept = {p: p.read_bytes() for p in (written / "out").rglob("*") if p.is_file()}
    out = written / "out"
    mount = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(out)]
    if os.geteuid() or not shutil.which("mount") or subprocess.run(mount).returncode:
        pytest.skip("only the superuser can mount a disk")
    try:
        for path, data in kept.items():
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(data)
        yield out
    finally:
        subprocess.run(["umount", str(out)], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("room", [0, 8192])
def test_a_full_disk(written: Place, disk: Path, refused: Refused, room: int) -> None:
    left = os.statvfs(disk)
    (disk / "filler").write_bytes(bytes(left.f_bavail * left.f_frsize - room))
    for name, command in commands(written).items():
        message = refused(command)
        assert "cannot write" in message and "No space left" in message, name
