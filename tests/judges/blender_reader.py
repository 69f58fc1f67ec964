"""Run by Blender's own Python: import a file and write what its shape keys play at frames.

blender_reader.py SOURCE OUT.json '[0, 10, ...]'
"""

import json
import sys
from pathlib import Path

import bpy

source, out, frames = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 60
if source.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=source)
else:
    bpy.ops.wm.usd_import(filepath=source)
played = []
for frame in frames:
    scene.frame_set(frame)
    meshes = {}
    for item in bpy.data.objects:
        if item.type == "MESH" and item.data.shape_keys:
            keys = item.data.shape_keys.key_blocks
            meshes[item.name] = {key.name: key.value for key in keys if key.name != "Basis"}
    played.append(meshes)
count = sum(item.type == "MESH" for item in bpy.data.objects)
Path(out).write_text(json.dumps({"frames": played, "meshes": count}), encoding="utf-8")
