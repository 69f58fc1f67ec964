"""A simulated first use of the bind page: `python benchmarks/bind_trial.py` (needs Chromium).

AnimFace's named 41-marker jaw take on two heads that it was not made for. A program does on the
page of `usdface bind`, in a real browser, with its mouse and its keys, what a newcomer would: look
at every marker and accept it, drag those that lie visibly wrong to where they belong, check the
neutral frames, save, make the shot. Commands are timed, every action counts `PACE` seconds. No
person was timed.
"""

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from usdface.io.bind_file import read_bind
from usdface.io.usd.rig import read_rig

ROOT = Path(__file__).resolve().parents[1]
SHARED = ROOT.parent / "shared" / "data"
sys.path.insert(0, str(ROOT / "tests"))
from bind_hand import place_of, saved  # noqa: E402
from chromium import Page, chromium_path, open_browser  # noqa: E402
from ict_face import write_meshes  # noqa: E402

PACE = (3.0, 5.0)  # [s] of an action: brisk, leisurely
TYPED = 4  # commands to type: rig, take, bind, shot; each counts as three actions
VISIBLE = 0.010  # [m] from where a person set a marker by eye: one would drag it

# Where a vertex of the face is in the window.
WINDOW = """(() => {
  const at = usdface.stage.centre.clone().fromArray(usdface.part.points, 3 * %d);
  at.add(usdface.figure.group.position).project(usdface.stage.camera);
  const box = usdface.stage.place.getBoundingClientRect();
  return [((at.x + 1) / 2) * box.width + box.left, ((1 - at.y) / 2) * box.height + box.top];
})()"""


def trial(head: str, source: Path, folder: Path) -> None:
    """Bind from nothing, and print how long it took and how good it is."""
    seconds, actions, drags = 0.0, 3 * TYPED, 0
    seconds += command(folder, "rig", source, "-o", "rig.usdc")
    seconds += command(folder, "take", SHARED / "animface" / "Jaw.c3d", "-o", "take.usdc")
    seconds += command(folder, "bind", "rig.usdc", "--take", "take.usdc", "-o", "bind.html")
    by_eye = read_bind(ROOT / "tests" / "data" / f"animface_{head}_bind.json")[0].binding
    truth = dict(zip(by_eye.markers, by_eye.points.tolist(), strict=True))
    mesh = read_rig(folder / "rig.usdc")[0].face()
    with open_browser(chromium_path() or "", folder) as browser:
        page = browser.page(folder / "bind.html")
        for _ in range(page.run("usdface.places.count")):
            name = page.run("usdface.page.markers[usdface.selected].name")
            if away(page, mesh.points, truth[name]) > VISIBLE:
                page.drag(place_of(page, name), tuple(page.run(WINDOW % truth[name])))
                drags += 1
            page.key("Enter")  # right as it is; the next one is selected
            actions += 1
        page.run("usdface.player.seek(usdface.neutral?.[0] ?? 0)")  # a look at the neutral frames
        page.key("t")  # the nose tip
        binding = read_bind(saved(page, folder))[0].binding
        actions += drags + 4  # neutral, nose tip, save, move the file
    shot = ("shot", "--rig", "rig.usdc", "--take", "take.usdc", "--bind", "bind.json")
    seconds += command(folder, *shot, "-o", "shot.usda")
    at = dict(zip(binding.markers, binding.points.tolist(), strict=True))
    off = [1e3 * float(np.linalg.norm(mesh.points[at[n]] - mesh.points[truth[n]])) for n in at]
    least, most = (seconds + pace * actions for pace in PACE)
    print(
        f"{head}: {len(at)} of {len(truth)} markers placed, {drags} dragged; from those set by eye "
        f"{np.median(off):.1f} mm in the median, {max(off):.1f} mm at most\n"
        f"  {actions} actions, commands {seconds:.0f} s: {least:.0f} to {most:.0f} s"
    )


def away(page: Page, points: np.ndarray, vertex: int) -> float:
    """How far the selected marker lies from a vertex [m]; infinite if it lies nowhere."""
    shown = page.run("usdface.places.shown(usdface.selected)")
    return float(np.linalg.norm(points[shown] - points[vertex])) if shown >= 0 else np.inf


def command(folder: Path, *words: str | Path) -> float:
    """Run a command of usdface in a folder; return its time [s]."""
    begin = time.perf_counter()
    program = [sys.executable, "-m", "usdface", *map(str, words)]
    subprocess.run(program, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin


def main() -> None:
    """Try both heads."""
    with tempfile.TemporaryDirectory() as place:
        for head in ("makehuman", "ict"):
            folder = Path(place) / head
            folder.mkdir()
            source = SHARED / "makehuman_cc0"
            if head == "ict":
                source = folder / "face"
                write_meshes(SHARED, source)
            trial(head, source, folder)
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
