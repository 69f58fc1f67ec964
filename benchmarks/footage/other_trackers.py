"""OpenCV's blob detector and Blender's tracker on the same images, where they are installed.

OpenCV: ``pip install opencv-python-headless`` beside usdface (the extra `bench`). Blender: an
interpreter with ``bpy`` in the variable USDFACE_BPY.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from usdface.io.images.read_image import read_image

__all__ = ["rows"]

NEAR = 6.0  # px, of a dot that is found


def rows(folder: Path, suffix: str, truth, footage) -> Iterator[str]:
    """Yield a line for each tracker that is there."""
    files = sorted(folder.glob(f"face.*.{suffix}"))
    yield from _opencv(files, truth, footage.model.channel)
    yield from _blender(files, truth)


def _score(name: str, places: list[np.ndarray], truth) -> str:
    """Score detections without labels: how many are found, errors, false ones."""
    errors, visible, extra = [], 0, 0
    for found, centroids, shares in zip(places, truth.centroids, truth.shares, strict=True):
        seen = shares >= 0.9
        visible += int(seen.sum())
        if not len(found):
            continue
        away, _ = cKDTree(found).query(centroids[seen])
        errors += away[away < NEAR].tolist()
        back, _ = cKDTree(centroids).query(found)
        extra += int((back >= NEAR).sum())
    rms = float(np.sqrt(np.mean(np.square(errors)) / 2)) if errors else float("nan")
    return (
        f"{name}: {100 * len(errors) / visible:.1f} % of visible dots found, centre {rms:.3f} px "
        f"RMS, {extra / len(places):.1f} false ones an image"
    )


def _opencv(files: list[Path], truth, channel) -> Iterator[str]:
    try:
        import cv2
    except ImportError:
        yield "OpenCV is not installed"
        return
    settings = cv2.SimpleBlobDetector_Params()
    detector = cv2.SimpleBlobDetector_create(settings)

    def found(picture: np.ndarray) -> np.ndarray:
        return np.array([point.pt for point in detector.detect(picture)]).reshape(-1, 2) + 0.5

    grey, coloured = [], []
    for file in files:
        pixels = read_image(file)
        grey.append(found(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)))
        lab = cv2.cvtColor(pixels, cv2.COLOR_RGB2LAB)
        coloured.append(found(lab[..., 1]))
    yield _score("OpenCV SimpleBlobDetector, grey", grey, truth)
    yield _score("OpenCV SimpleBlobDetector, a* of Lab", coloured, truth)


def _blender(files: list[Path], truth) -> Iterator[str]:
    program = os.environ.get("USDFACE_BPY", "")
    if not program:
        yield "Blender: no USDFACE_BPY"
        return
    seen = truth.shares[0] >= 0.9
    with tempfile.TemporaryDirectory() as folder:
        task = Path(folder) / "task.json"
        out = Path(folder) / "tracks.json"
        given = {"first": str(files[0]), "places": truth.centroids[0].tolist(), "out": str(out)}
        task.write_text(json.dumps({**given, "count": len(files)}))
        script = Path(__file__).with_name("blender_tracker.py")
        done = subprocess.run([program, str(script), str(task)], capture_output=True, text=True)
        if done.returncode or not out.exists():
            yield f"Blender failed: {done.stderr.strip().splitlines()[-1:]}"
            print(done.stderr, file=sys.stderr)
            return
        tracks = np.array(json.loads(out.read_text()), dtype=float)  # (F, M, 2), NaN = lost
    error = np.linalg.norm(tracks - truth.centroids, axis=2)
    visible = (truth.shares >= 0.9) & seen
    given = visible & ~np.isnan(error)
    right = given & (error < NEAR)
    rms = float(np.sqrt((error[right] ** 2).mean() / 2))
    yield (
        f"Blender's tracker, given the {int(seen.sum())} dots of the first image: "
        f"{100 * given.sum() / visible.sum():.1f} % of their visible samples kept, labels right "
        f"{100 * right.sum() / given.sum():.2f} %, centre {rms:.3f} px RMS"
    )
