"""Run by Blender's own Python: import a file and write what its shape keys play at frames.

blender_reader.py SOURCE OUT.json '[0, 10, ...]' [CLIP [points]]

With the word "points" also where all vertices are, Y up.
"""

import json
import sys
from pathlib import Path

import bpy

source, out, frames = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
clip = sys.argv[4] if len(sys.argv) > 4 else ""
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = 60
if source.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=source)
else:
    bpy.ops.wm.usd_import(filepath=source)
for keys in bpy.data.shape_keys if clip else ():
    # The glTF importer puts each animation on a track of its own, whose strips begin at frame 1.
    data = keys.animation_data
    (strip,) = next(track.strips for track in data.nla_tracks if track.name == clip)
    data.use_nla = False
    data.action, data.action_slot = strip.action, strip.action_slot
# The importer draws joints as a mesh of its own.
armatures = [item for item in bpy.data.objects if item.type == "ARMATURE"]
drawn = {bone.custom_shape for item in armatures for bone in item.pose.bones}
hidden = {item.name for item in drawn if item}
played, points = [], []
for frame in frames:
    scene.frame_set(frame)
    meshes = {}
    graph = bpy.context.evaluated_depsgraph_get()
    points.append([])
    for item in bpy.data.objects:
        if item.type == "MESH" and item.name not in hidden and sys.argv[5:] == ["points"]:
            shown = item.evaluated_get(graph)
            places = (shown.matrix_world @ v.co for v in shown.to_mesh().vertices)
            points[-1] += [(p.x, p.z, -p.y) for p in places]  # Y up
    for item in bpy.data.objects:
        if item.type == "MESH" and item.data.shape_keys:
            keys = item.data.shape_keys.key_blocks
            meshes[item.name] = {key.name: key.value for key in keys if key.name != "Basis"}
    played.append(meshes)
count = sum(item.type == "MESH" and item not in drawn for item in bpy.data.objects)
answer = {"frames": played, "meshes": count, "points": points}
Path(out).write_text(json.dumps(answer), encoding="utf-8")
