"""Many shots in one process: memory and open files stay flat. `python tests/attack/soak.py`."""

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("USDFACE_TRUSTED", "1")

from worlds import make_world

import usdface

__all__ = ["soak"]


def soak(folder: Path, count: int, every: int = 50) -> list[tuple[int, float, int]]:
    """Make and process shots; return number, memory [MB] and open files after each `every`."""
    made = make_world().write(folder)
    rig, take, shot = (made / name for name in ("rig.usda", "take.usda", "shot.usda"))
    found = []
    for number in range(1, count + 1):
        usdface.make_shot(rig, take, shot, bind=made / "bind.json")
        usdface.process(shot, gltf=made / "face.glb")
        if number % every == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            memory = pages * os.sysconf("SC_PAGESIZE") / 1e6
            found.append((number, memory, len(os.listdir("/proc/self/fd"))))  # noqa: PTH208
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shots", type=int, default=1000)
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="usdface-soak-"))
    try:
        for number, memory, files in soak(folder, given.shots, max(1, given.shots // 20)):
            print(f"{number:6} shots  {memory:8.1f} MB  {files} open files")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
