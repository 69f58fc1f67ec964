"""Run by Blender's own Python: `blender_convert.py SOURCE RESULT RATE`, between USD and GLB."""

import sys

import bpy

source, result, rate = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.fps = int(rate)
if source.endswith(".glb"):
    bpy.ops.import_scene.gltf(filepath=source)
else:
    bpy.ops.wm.usd_import(filepath=source)
ends = [action.frame_range for action in bpy.data.actions]
scene.frame_start = int(min((begin for begin, _ in ends), default=0))
scene.frame_end = int(max((end for _, end in ends), default=0))
if result.endswith(".glb"):
    bpy.ops.export_scene.gltf(filepath=result, export_format="GLB", export_animations=True)
else:
    bpy.ops.wm.usd_export(filepath=result, export_animation=True)
