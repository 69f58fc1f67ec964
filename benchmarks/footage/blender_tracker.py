"""Tracks dots by Blender's own tracker (libmv); run by its interpreter, with a task as JSON."""

import json
import sys
from pathlib import Path

import bpy


def main() -> None:
    task = json.loads(Path(sys.argv[1]).read_text())
    clip = bpy.data.movieclips.load(task["first"])
    width, height = clip.size
    bpy.context.scene.frame_end = task["count"]
    settings = clip.tracking.settings
    settings.default_pattern_size, settings.default_search_size = 25, 75
    settings.default_motion_model = "LocRotScale"
    settings.default_pattern_match = "PREV_FRAME"
    settings.use_default_normalization = True
    for number, (x, y) in enumerate(task["places"]):
        track = clip.tracking.tracks.new(name=f"dot_{number}", frame=1)
        track.markers[0].co = x / width, 1 - y / height
    area_type = bpy.context.window.screen.areas[0]
    area_type.type = "CLIP_EDITOR"
    area_type.spaces.active.clip = clip
    region = next(r for r in area_type.regions if r.type == "WINDOW")
    for track in clip.tracking.tracks:
        track.select = True
    with bpy.context.temp_override(area=area_type, region=region):
        bpy.ops.clip.track_markers(backwards=False, sequence=True)
    rows = []
    for frame in range(1, task["count"] + 1):
        row = []
        for number in range(len(task["places"])):
            marker = clip.tracking.tracks[f"dot_{number}"].markers.find_frame(frame)
            lost = marker is None or marker.mute
            row.append(
                [None, None] if lost else [marker.co[0] * width, (1 - marker.co[1]) * height]
            )
        rows.append(row)
    Path(task["out"]).write_text(json.dumps(rows))


main()
