"""Films of a head with painted dots: curves, head motion, camera, what a phone does to an image."""

import json
import os
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from scipy import ndimage

from benchmarks.footage.rendering import Camera, Paint, render
from usdface import read_rig, read_take
from usdface.face.curve_mapping import rename_weights
from usdface.figures.rig_picture import rig_triangles
from usdface.geometry.vertex_normals import triangle_normals
from usdface.rigs import Rig
from usdface.takes import WeightsTake

__all__ = [
    "CLEAN",
    "PHONE",
    "Film",
    "Look",
    "Truth",
    "example_film",
    "ict_film",
    "recorded_curves",
    "shoot",
    "swaying",
]

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("USDFACE_SHARED", ROOT.parent / "shared")) / "data"
PAINT = {"green": (0.05, 0.42, 0.12), "blue": (0.06, 0.13, 0.55), "black": (0.025, 0.022, 0.02)}
LEFT_OUT = ("brow_left", "brow_right")  # they lie above the skin that carries the dots
NECK = np.array([0.0, -0.12, -0.03])


@dataclass(frozen=True)
class Look:
    """What lens, sensor and file do to an image.

    `blur` [px] deviation of the lens's point spread; `noise` [code values] of 8 bits; `chroma`
    noise that is coarse in colour; `jpeg` quality, 0 = PNG; `shutter` share of a frame; `light`
    factor.
    """

    blur: float = 0.6
    noise: float = 0.7
    jpeg: int = 0
    shutter: float = 0.0
    samples: int = 3
    light: float = 1.0


CLEAN = Look()
PHONE = Look(blur=1.1, noise=3.0, jpeg=80, shutter=0.5, samples=2)


@dataclass(frozen=True)
class Film:
    """A head, dots on it, weights (F, S) by name, pose (F, 4, 4) into camera space."""

    names: tuple[str, ...]
    points: np.ndarray  # (F, V, 3) in camera space
    triangles: np.ndarray
    albedo: np.ndarray
    paint: Paint
    vertices: np.ndarray
    camera: Camera
    rate: float
    weights: np.ndarray
    shapes: tuple[str, ...]
    hand: bool = False

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class Truth:
    """Of F frames and M dots: projected vertices and centroids (F, M, 2) [px], visible share."""

    names: tuple[str, ...]
    vertices: np.ndarray
    centroids: np.ndarray
    shares: np.ndarray


def _reachable(points: np.ndarray, triangles: np.ndarray, start: int, radius: float) -> np.ndarray:
    """Return the triangles that hang together with a vertex, within a radius along the skin."""
    near = np.linalg.norm(points - points[start], axis=1) < radius
    inside = np.zeros(len(points), bool)
    inside[start] = True
    for _ in range(60):
        touched = triangles[inside[triangles].any(axis=1)]
        grown = inside.copy()
        grown[touched] = True
        grown &= near | inside
        if (grown == inside).all():
            break
        inside = grown
    return np.flatnonzero(inside[triangles].any(axis=1))


def _rotation(angles: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("YXZ", angles, degrees=True).as_matrix()


def example_film(
    weights: np.ndarray,
    shapes: tuple[str, ...],
    angles: np.ndarray,
    shift: np.ndarray,
    *,
    size: tuple[int, int] = (1280, 960),
    colour: str = "green",
    radius: float = 0.0021,
    rate: float = 30.0,
    hand: bool = False,
) -> Film:
    """Return a film of the example's head.

    Parameters
    ----------
    weights : (F, S)
    shapes : tuple of str, length S
    angles : (F, 3) [degree]
        Yaw, pitch, roll of the head about the neck.
    shift : (F, 3) [m]
    """
    rig, _ = read_rig(ROOT / "examples" / "head.usdc")
    rig = replace(rig, meshes=tuple(mesh for mesh in rig.meshes if mesh.name not in LEFT_OUT))
    bind = json.loads((ROOT / "examples" / "bind.json").read_text())
    names = tuple(bind["markers"])
    vertices = np.array([bind["markers"][name]["point"] for name in names])
    return head_film(
        rig, names, vertices, weights, shapes, angles, shift,
        size=size, colour=colour, radius=radius, rate=rate, hand=hand,
    )  # fmt: skip


def ict_film(
    weights: np.ndarray,
    shapes: tuple[str, ...],
    angles: np.ndarray,
    shift: np.ndarray,
) -> Film:
    """Return a film of the ICT face with 41 dots, as `example_film` of the example's head.

    Its eyeballs and teeth have the colour of skin.
    """
    sys.path.insert(0, str(ROOT / "tests"))
    from faces import make_face

    face = make_face("ict41", SHARED)
    binding = face.setup.binding
    # Where the example's head is: the camera, and the neck that it turns about, stay.
    place = face.mesh.points - face.mesh.points[binding.points].mean(axis=0)
    mesh = replace(face.mesh, points=place + np.array([0.0, -0.01, 0.06]))
    take = WeightsTake(shapes, np.arange(len(weights)) / 30.0, weights, 30.0)
    own = rename_weights(take, mesh.shape_names)[0]
    return head_film(
        Rig("ict", (mesh,)), binding.markers, np.array(binding.points), own.weights, own.names,
        angles, shift,
    )  # fmt: skip


def head_film(
    rig: Rig,
    names: tuple[str, ...],
    vertices: np.ndarray,
    weights: np.ndarray,
    shapes: tuple[str, ...],
    angles: np.ndarray,
    shift: np.ndarray,
    *,
    size: tuple[int, int] = (1280, 960),
    colour: str = "green",
    radius: float = 0.0021,
    rate: float = 30.0,
    hand: bool = False,
) -> Film:
    """Return a film of a head whose first mesh has dots at vertices (M,); see `example_film`."""
    posed = rig_triangles(rig, shapes, weights)
    rest = rig_triangles(rig, shapes, np.zeros((1, len(shapes)))).points[0]
    head = len(rig.meshes[0].points)
    on_head = (posed.triangles < head).all(axis=1)
    of_triangle = np.full(len(posed.triangles), -1, np.int32)
    triangles = np.where(on_head[:, None], posed.triangles, 0)
    for dot, vertex in enumerate(vertices.tolist()):
        # A vertex grid is coarser than a dot: reach one ring of faces beyond it.
        of = _reachable(rest, triangles, vertex, radius * 1.2)
        of_triangle[of[on_head[of]]] = dot
    albedo = np.zeros((posed.points.shape[1], 3))
    for k in range(3):
        np.maximum.at(albedo[:, k], posed.triangles.ravel(), np.repeat(posed.colours[:, k], 3))
    albedo[:head] = (0.58, 0.36, 0.27)
    random = np.random.default_rng(5)
    albedo[:head] *= 1 + 0.05 * random.normal(size=(head, 1)) + 0.02 * random.normal(size=(head, 3))
    turned = np.einsum("fab,fvb->fva", _rotation(angles), posed.points - NECK) + NECK
    distance, focal = 0.52, 1500.0 * size[0] / 1280
    points = turned + shift[:, None] + (0.0, 0.0, -distance)
    paint = Paint(rest, of_triangle, rest[vertices], radius, PAINT[colour])
    return Film(
        names, points, posed.triangles, albedo, paint, vertices, Camera(focal, size), rate,
        weights, shapes, hand,
    )  # fmt: skip


def _backdrop(size: tuple[int, int]) -> np.ndarray:
    """Return a room out of focus: shelves, a plant, a bright window."""
    width, height = size
    random = np.random.default_rng(3)
    coarse = random.uniform(0.05, 0.35, (6, 8, 1)) * random.uniform(0.7, 1.3, (6, 8, 3))
    coarse[3:, :2] = (0.06, 0.16, 0.05)
    coarse[:2, 6:] = (0.9, 0.95, 1.0)
    image = np.stack(
        [ndimage.zoom(coarse[..., k], (height / 6, width / 8), order=1) for k in range(3)], axis=2
    )
    return image.clip(0, 1)


def _hand(film: Film, frame: float) -> np.ndarray | None:
    """Return a hand that passes through the picture in the middle of the film."""
    if not film.hand:
        return None
    width, height = film.camera.size
    place = (frame / len(film) - 0.4) / 0.25
    if not -0.2 < place < 1.2:
        return None
    y, x = np.mgrid[:height, :width]
    across = (x - width * place + 0.3 * (y - height / 2)) / (0.05 * width)
    cover = ((np.abs(across) < 1) & (y > 0.3 * height)).astype(float)
    result = np.empty((height, width, 4))
    result[..., :3] = (0.5, 0.31, 0.24)
    result[..., 3] = ndimage.uniform_filter(cover, 3)
    return result


def encode(linear: np.ndarray) -> np.ndarray:
    """Return display-encoded values (sRGB)."""
    linear = linear.clip(0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def frame_image(film: Film, frame: int, look: Look, backdrop: np.ndarray):
    """Return an image (H, W, 3) uint8 and the truth of its dots."""
    times = np.linspace(-0.5, 0.5, 3) * look.shutter if look.shutter else np.zeros(1)
    total = 0.0
    truth = None
    for time in times.tolist():
        other = min(max(frame + (1 if time > 0 else -1), 0), len(film) - 1)
        points = film.points[frame] + abs(time) * (film.points[other] - film.points[frame])
        normals = triangle_normals(points, film.triangles)
        image, shares, centroids = render(
            points, film.triangles, normals, film.albedo, film.paint, film.camera, backdrop,
            look.samples, _hand(film, frame + time),
        )  # fmt: skip
        total = total + image / len(times)
        if time == 0:
            truth = film.camera.project(points[film.vertices]), centroids, shares
    blurred = ndimage.gaussian_filter(total * look.light, (look.blur, look.blur, 0))
    random = np.random.default_rng([11, frame])
    codes = 255 * encode(blurred)
    grain = random.normal(0, look.noise, codes.shape)
    if look.jpeg:  # a phone smooths its noise
        grain = 0.6 * grain + 1.2 * ndimage.gaussian_filter(grain, (1.0, 1.0, 0))
    return np.rint(codes + grain).clip(0, 255).astype(np.uint8), truth


def write_image(pixels: np.ndarray, path: Path, quality: int = 0) -> None:
    """Write an image; JPEG with colours at half resolution."""
    height, width = pixels.shape[:2]
    spec = oiio.ImageSpec(width, height, 3, "uint8")
    if quality:
        spec.attribute("Compression", f"jpeg:{quality}")
        spec.attribute("jpeg:subsampling", "4:2:0")
    else:
        spec.attribute("png:compressionLevel", 1)
    file = oiio.ImageOutput.create(str(path))
    if not (file and file.open(str(path), spec)):
        raise OSError(oiio.geterror())
    file.write_image(np.ascontiguousarray(pixels))
    file.close()


def shoot(film: Film, look: Look, folder: Path) -> Truth:
    """Write the images of a film, or take those of an earlier run, and return the truth."""
    known = folder / "truth.npz"
    if not known.exists():
        folder.mkdir(parents=True, exist_ok=True)
        backdrop = ndimage.gaussian_filter(_backdrop(film.camera.size), (12, 12, 0))
        suffix = "jpg" if look.jpeg else "png"
        truths = []
        for frame in range(len(film)):
            pixels, truth = frame_image(film, frame, look, backdrop)
            write_image(pixels, folder / f"face.{frame + 1:04d}.{suffix}", look.jpeg)
            truths.append(truth)
        vertices, centroids, shares = (np.array(each) for each in zip(*truths, strict=True))
        np.savez(known, vertices=vertices, centroids=centroids, shares=shares)
    with np.load(known) as data:
        return Truth(film.names, data["vertices"], data["centroids"], data["shares"])


def recorded_curves(seconds: float, rate: float, start: float = 0.0):
    """Return weights (F, S) and names of a real take (Live Link Face), at a rate."""
    path = sorted((SHARED / "livelinkface").glob("*.csv"))[0]
    take, _ = read_take(path)
    times = start + np.arange(round(seconds * rate)) / rate
    weights = np.stack(
        [np.interp(times, take.times, take.weights[:, k]) for k in range(len(take.names))], axis=1
    )
    return weights.clip(0, 1), take.names


def swaying(count: int, rate: float, yaw: float, pitch: float = 5.0, roll: float = 3.0):
    """Return angles (F, 3) [degree] and shifts (F, 3) [m] of a head that turns about."""
    t = np.arange(count) / rate
    angles = np.stack(
        [
            yaw * np.sin(2 * np.pi * 0.27 * t),
            pitch * np.sin(2 * np.pi * 0.19 * t + 0.7) - pitch * np.sin(0.7),
            roll * np.sin(2 * np.pi * 0.23 * t + 1.9) - roll * np.sin(1.9),
        ],
        axis=1,
    )
    wave = np.sin(2 * np.pi * np.outer(t, (0.21, 0.33, 0.17)) + (0.3, 1.2, 2.0))
    return angles, (wave - wave[:1]) * (0.015, 0.008, 0.02)


def temporary_folder() -> Path:
    """Return the folder of films that benchmarks share."""
    return Path(tempfile.gettempdir()) / "usdface_footage"
