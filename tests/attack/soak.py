"""Many shots in one process: memory and open files stay flat. `python tests/attack/soak.py`.

With `--usd` no shots: stages that are opened and closed by OpenUSD alone, to tell how much of the
memory that a process keeps is USD's.
"""

import argparse
import ctypes
import gc
import os
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("USDFACE_TRUSTED", "1")

from pxr import Sdf, Usd, UsdGeom
from worlds import make_world

import usdface

__all__ = ["allocated", "soak", "usd_alone"]


class _Heap(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "abcdefghij"]


def allocated() -> int:
    """Bytes that are allocated natively; 0 where the C library does not tell (glibc does)."""
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        return 0
    library.mallinfo2.restype = _Heap
    gc.collect()
    found = library.mallinfo2()
    return int(found.h + found.e)  # in small and in large blocks


def soak(folder: Path, count: int, every: int = 50) -> list[tuple[int, float, float, int]]:
    """Make and process shots.

    Returns
    -------
    list of (number, memory [MB], natively allocated [MB], open files)
        After each `every`.
    """
    made = make_world().write(folder)
    rig, take, shot = (made / name for name in ("rig.usda", "take.usda", "shot.usda"))
    found = []
    for number in range(1, count + 1):
        usdface.make_shot(rig, take, shot, bind=made / "bind.json")
        usdface.process(shot, gltf=made / "face.glb")
        if number % every == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            memory = pages * os.sysconf("SC_PAGESIZE") / 1e6
            files = len(os.listdir("/proc/self/fd"))  # noqa: PTH208
            found.append((number, memory, allocated() / 1e6, files))
    return found


def usd_alone(folder: Path, count: int) -> list[tuple[str, float]]:
    """Open a stage of two layers many times with OpenUSD alone, in five ways.

    Returns
    -------
    list of (way, bytes that each time leaves allocated)
    """
    below, top = folder / "below.usda", folder / "top.usda"
    stage = Usd.Stage.CreateNew(str(below))
    for number in range(20):
        UsdGeom.Xform.Define(stage, f"/A/B{number}")
    stage.Save()
    stage = Usd.Stage.CreateNew(str(top))
    stage.GetRootLayer().subLayerPaths = ["./below.usda"]
    stage.Save()
    del stage
    handles: list[Sdf.Spec] = []

    def opened() -> None:
        Usd.Stage.Open(str(top))

    def reached() -> None:
        Usd.Stage.Open(str(top)).GetUsedLayers()

    def owned() -> None:
        handles.clear()
        stage = Usd.Stage.Open(str(top))
        for layer in stage.GetUsedLayers():
            handles.append(Sdf.Layer.FindOrOpen(layer.identifier).pseudoRoot)

    def written() -> None:
        Sdf.Layer.FindOrOpen(str(below)).ExportToString()

    def written_held() -> None:
        handles.clear()
        layer = Sdf.Layer.FindOrOpen(str(below))
        layer.Traverse("/", lambda path: handles.append(layer.GetObjectAtPath(path)))
        layer.ExportToString()

    ways: dict[str, Callable[[], None]] = {
        "stage opened": opened,
        "stage opened, its layers reached": reached,
        "the same, layers owned and roots held": owned,
        "layer of 21 prims opened and written": written,
        "the same, its specs held": written_held,
    }
    growth = []
    for way, once in ways.items():
        for _ in range(100):
            once()
        before = allocated()
        for _ in range(count):
            once()
        growth.append((way, (allocated() - before) / count))
    return growth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shots", type=int, default=1000)
    parser.add_argument("--usd", action="store_true", help="OpenUSD alone, without usdface")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="usdface-soak-"))
    try:
        if given.usd:
            for way, growth in usd_alone(folder, given.shots):
                print(f"{growth:8.1f} bytes  {way}")
            return
        for number, memory, held, files in soak(folder, given.shots, max(1, given.shots // 20)):
            print(f"{number:6} shots  {memory:8.2f} MB  {held:8.3f} MB held  {files} open files")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
