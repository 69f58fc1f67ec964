"""How surely calibrated cameras place markers: `python benchmarks/cameras.py`.

Made points in a cube of 16 cm, filmed from 0.6 m (focal length 1400 px, lens distortion), each
pixel with 0.3 px of noise; the error of the triangulated points beside the one that the fit's
covariance predicts.
"""

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

from usdface.geometry.camera import Camera, project
from usdface.geometry.multi_view import triangulate

NOISE = 0.3  # px
CENTRE = np.array([0.0, 0.0, 0.6])  # m
SETS = {
    "two, 10 degrees apart": (0, 10),
    "two, 20 degrees": (0, 20),
    "two, 40 degrees": (0, 40),
    "two, 60 degrees": (0, 60),
    "two, 90 degrees": (0, 90),
    "three, 30 degrees": (0, 30, 60),
    "four, 30 degrees": (0, 30, 60, 90),
}


def camera(angle: float) -> Camera:
    """A camera on a circle around the face, at an angle [degrees] from the first."""
    turn = Rotation.from_euler("y", -angle, degrees=True).as_matrix()
    matrix = np.array([[1400.0, 0, 640], [0, 1400, 480], [0, 0, 1]])
    lens = np.array([-0.2, 0.09, 8e-4, -5e-4, -0.01, 0, 0, 0])
    return Camera(matrix, lens, turn, CENTRE - turn @ CENTRE)


def main() -> None:
    rng = np.random.default_rng(0)
    points = CENTRE + rng.uniform(-0.08, 0.08, (20_000, 3))
    table = Table("cameras", "error [mm]", "predicted [mm]", "of it towards the cameras [mm]")
    for name, angles in SETS.items():
        cameras = [camera(angle) for angle in angles]
        pixels = np.stack([project(each, points) for each in cameras])
        solved = triangulate(cameras, pixels + rng.normal(0, NOISE, pixels.shape))
        away = 1000 * (solved.points - points)
        # Seen from the middle of the cameras.
        ahead = Rotation.from_euler("y", np.mean(angles), degrees=True).apply([0, 0, 1])
        predicted = 1000 * NOISE * np.sqrt(solved.spread.trace(axis1=1, axis2=2).mean())
        error = np.sqrt((away**2).sum(axis=1).mean())
        deep = np.sqrt(((away @ ahead) ** 2).mean())
        table.add_row(name, f"{error:.2f}", f"{predicted:.2f}", f"{deep:.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
