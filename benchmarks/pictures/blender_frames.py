"""Render meshes with Blender's Workbench: run by a Python that has bpy, with a file of arrays."""

import sys
from pathlib import Path

import bpy
import numpy as np


def main() -> None:
    path = Path(sys.argv[1])
    with np.load(path) as scene:
        points, triangles = scene["points"], scene["triangles"]
        centre, height = scene["centre"], float(scene["height"])
        width, tall = scene["size"].tolist()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("face")
    # Blender's up is z.
    points = points[..., [0, 2, 1]] * np.float32([1, -1, 1])
    centre = centre[[0, 2, 1]] * [1, -1, 1]
    mesh.from_pydata(points[0].tolist(), [], triangles.tolist())
    mesh.shade_smooth()
    scene = bpy.context.scene
    scene.collection.objects.link(bpy.data.objects.new("face", mesh))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.type, camera.data.clip_end = "ORTHO", 100.0
    camera.data.ortho_scale = height * max(width, tall) / tall
    camera.location = (centre[0], points[..., 1].min() - 1.0, centre[2])
    camera.rotation_euler = (np.pi / 2, 0, 0)
    render, shading = scene.render, scene.display.shading
    render.engine = "BLENDER_WORKBENCH"
    shading.light, shading.color_type = "STUDIO", "SINGLE"
    shading.single_color = (0.85, 0.74, 0.66)
    shading.show_cavity, shading.cavity_type = True, "BOTH"
    render.film_transparent = True
    scene.display.render_aa = "8"
    render.resolution_x, render.resolution_y = width, tall
    for number, shown in enumerate(points):
        mesh.vertices.foreach_set("co", shown.ravel())
        mesh.update()
        render.filepath = str(path.with_name(f"{number:04d}.png"))
        bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
