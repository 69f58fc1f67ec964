"""Run by Blender's own Python: one scenario with the installed extension, its answer as JSON.

blender_plugin.py SCENARIO FOLDER OUT.json
"""

import json
import os
import signal
import sys
import time
from importlib import import_module
from pathlib import Path

import bpy
import numpy as np

addon_utils = import_module("addon_utils")  # on the path once bpy is loaded
MODULE = "bl_ext.user_default.usdface"
ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
FRAMES = 240  # of the take as empties


def part(name):
    return import_module(f"{MODULE}.{name}")


def settings():
    return bpy.context.scene.usdface


def empty_scene():
    bpy.ops.wm.read_homefile(use_empty=True)


def example(folder, take="performance.trc"):
    """The head of the example with its markers, and a take as a file."""
    empty_scene()
    bpy.ops.wm.usd_import(filepath=str(EXAMPLES / "head.usdc"))
    chosen = settings()
    chosen.character = bpy.data.objects["Face"]
    chosen.take_file = str(EXAMPLES / take)
    chosen.folder = str(folder / "work")
    binding = json.loads((EXAMPLES / "bind.json").read_text())
    part("places").show_places(bpy.context.scene, binding)
    bpy.context.view_layer.update()
    return chosen


def performer(frames=FRAMES, animated=True):
    """The take of the example as a collection of animated empties, at 60 fps."""
    import usdface

    take, _ = usdface.read_take(EXAMPLES / "take.usdc")
    scene, group = bpy.context.scene, bpy.data.collections.new("performer")
    scene.collection.children.link(group)
    scene.render.fps, scene.frame_start, scene.frame_end = 60, 1, frames
    for m, name in enumerate(take.names):
        places = take.positions[:frames, m]
        seen = np.isfinite(places[:, 0])
        codes = np.arange(1, frames + 1)
        places = [np.interp(codes, codes[seen], places[seen, axis]) for axis in range(3)]
        empty = bpy.data.objects.new(f"performer {name}", None)
        empty["usdface_marker"] = name
        group.objects.link(empty)
        curves = dict(enumerate((places[0], -places[2], places[1])))
        if animated:
            animate(empty, "OBJECT", {("location", axis): (codes, c) for axis, c in curves.items()})
    return group


def animate(item, kind, curves):
    action = bpy.data.actions.new(item.name)
    slot = action.slots.new(kind, item.name)
    strip = action.layers.new("curves").strips.new(type="KEYFRAME")
    bag = strip.channelbag(slot, ensure=True)
    for (path, index), (codes, values) in curves.items():
        curve = bag.fcurves.new(path, index=index)
        curve.keyframe_points.add(len(codes))
        points = np.column_stack([codes, values]).astype(np.float32)
        curve.keyframe_points.foreach_set("co", points.ravel())
        curve.keyframe_points.foreach_set("interpolation", [1] * len(codes))
        curve.update()
    data = item.animation_data or item.animation_data_create()
    data.action, data.action_slot = action, slot


def played(first, count):
    """What the shape keys of the scene are at each frame."""
    scene, found = bpy.context.scene, {}
    keys = [
        (f"{o.name}/{key.name}", key)
        for o in bpy.data.objects
        if o.type == "MESH" and o.data.shape_keys
        for key in o.data.shape_keys.key_blocks
        if key != o.data.shape_keys.reference_key
    ]
    rows = []
    for frame in range(count):
        scene.frame_set(first + frame)
        rows.append([key.value for _, key in keys])
    for i, (name, _) in enumerate(keys):
        found[name] = [row[i] for row in rows]
    return found


def largest_difference(shown, weights):
    """Between shape keys and the columns of a result of equal name; and how much these move."""
    columns = dict(zip(weights.names, weights.weights.T, strict=True))
    known = {name: name.partition("/")[2] for name in shown}
    errors = [
        np.abs(np.array(shown[n]) - columns[k]).max() for n, k in known.items() if k in columns
    ]
    return float(max(errors)), len(errors), float(np.ptp(weights.weights, axis=0).max())


def attempt(operator, **words):
    """Call an operator; return what it reports as an error, "" if it does not."""
    try:
        operator(**words)
    except RuntimeError as error:
        return str(error)
    return ""


def messages():
    return [(m.severity, m.text, m.remedy) for m in settings().messages]


def panel(folder):
    """Process the example, and all that is done with its result."""
    import usdface

    chosen = example(folder)
    keys = bpy.data.objects["head"].data.shape_keys
    animate(keys, "KEY", {('key_blocks["jawOpen"].value', 0): ([1, 10], [0.0, 0.7])})
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.usdface.process()
    bpy.ops.ed.undo_push(message="after")
    answer = {}
    result, _ = usdface.read_result(chosen.result)
    count, first = len(result.corrected.times), chosen.first_frame
    for share, weights in ((1.0, result.corrected), (0.0, result.solved)):
        settings().influence = share
        answer[f"at {share}"] = largest_difference(played(first, count), weights)
    settings().influence = 0.5
    half = usdface.WeightsTake(
        result.corrected.names,
        result.corrected.times,
        (result.solved.weights + result.corrected.weights) / 2,
    )
    answer["at 0.5"] = largest_difference(played(first, count), half)
    settings().influence = 1.0
    render = bpy.context.scene.render
    data = bpy.data.objects["head"].data.shape_keys.animation_data
    answer |= {
        "clock": [
            render.fps / render.fps_base,
            bpy.context.scene.frame_start,
            bpy.context.scene.frame_end,
        ],
        "tracks": {t.name: [t.mute, len(t.strips)] for t in data.nla_tracks},
        "gains": [g.name for g in settings().gains],
        "worst": [[w.frame, w.residual] for w in settings().worst],
        "residual": (1000 * result.residual).tolist(),
        "verdict": settings().verdict,
    }
    part("last_result").keep(bpy.context.scene, result)
    index = 72
    rules = part("last_result").rules_at(bpy.context.scene, first + index)
    answer["rules"] = rules
    answer["firing"] = sorted(map(float, result.firing[index]), reverse=True)
    bpy.ops.usdface.worst_frame()
    answer["went to"] = bpy.context.scene.frame_current
    glb = folder / "theirs.glb"
    bpy.ops.export_scene.gltf(filepath=str(glb), export_animation_mode="NLA_TRACKS")
    bpy.ops.usdface.choose_gltf(filepath=str(folder / "ours.glb"))
    answer["drawn"] = draw_all()
    sys.path.append(str(ROOT / "docs"))
    answer["pictured"] = import_module("blender_scene").panels_drawn()
    settings().gains["joy"].value = 0.0
    before = len(bpy.data.actions)
    bpy.ops.usdface.process()
    answer["actions"] = [before, len(bpy.data.actions)]
    quiet, _ = usdface.read_result(settings().result)
    answer["joy"] = [float(r.corrected.weights[72].sum()) for r in (result, quiet)]
    bpy.ops.ed.undo_push(message="again")
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    answer["undone"] = [len(bpy.data.actions), scene.render.fps, scene.usdface.result]
    return answer


class Recorder:
    """A stand-in of a layout: takes what a panel draws, and checks that it is there."""

    def __init__(self, drawn):
        self.drawn, self.active = drawn, True

    def __getattr__(self, name):
        return lambda *_, **__: Recorder(self.drawn)

    def prop(self, data, name, **_):
        assert name in data.bl_rna.properties, name
        self.drawn.append(name)

    def label(self, text="", **_):
        self.drawn.append(text)

    def operator(self, name, **_):
        group, operator = name.split(".")
        kind = getattr(getattr(bpy.ops, group), operator).get_rna_type()
        self.drawn.append(name)

        class Properties:
            def __setattr__(self, key, value):
                assert key in kind.properties, (name, key)

        return Properties()


def draw_all():
    """Draw every panel into a stand-in."""
    drawn = []
    for kind in part("panel").PANELS:
        stand_in = type(
            "Panel",
            (),
            {"layout": Recorder(drawn)}
            | {
                k: v
                for k, v in vars(kind).items()
                if k.startswith("_") and callable(v) and not k.startswith("__")
            },
        )()
        kind.draw(stand_in, bpy.context)
    return drawn


def hook(folder):
    """Export with the hook, process on; and what a plain export and commands need for the same."""
    chosen = example(folder)
    chosen.take_kind, chosen.take_markers = "EMPTIES", performer()
    chosen.export_process = True
    bpy.ops.wm.usd_export(filepath=str(folder / "shot.usda"), export_animation=True)
    result = messages()
    chosen.export_setup = False
    bpy.ops.wm.usd_export(filepath=str(folder / "plain.usda"), export_animation=True)
    process = part("process")
    work = process.work_folder(bpy.context.scene)
    take, _ = part("takes").write_take_of_empties(bpy.context.scene, work)
    part("character").export_character(chosen.character, folder / "character.usda")
    meshes = part("character").face_meshes(chosen.character)
    mesh = process._prepare_rig(folder / "character.usda", meshes)
    part("places").write_bind(bpy.context.scene, mesh, folder / "bind.json")
    return {"messages": result, "csv": str(take)}


def trip(folder):
    """A shot into Blender and out again, and a result."""
    answer = {}
    for name in ("shot.usda", "shot.usdface.usda"):
        empty_scene()
        bpy.ops.wm.usd_import(filepath=str(folder / "in" / name))
        chosen, scene = settings(), bpy.context.scene
        bpy.ops.wm.usd_export(filepath=str(folder / f"out_{name}"), export_animation=True)
        answer[name] = {
            "fps": scene.render.fps,
            "range": [scene.frame_start, scene.frame_end],
            "objects": sorted(o.name for o in bpy.data.objects if o.type != "MESH"),
            "messages": messages(),
            "tracks": [t.name for t in tracks_of("head")],
            "result": chosen.result,
        }
    chosen.folder = str(folder / "work")
    bpy.ops.usdface.process()
    answer["processed"] = settings().result
    return answer


def tracks_of(name):
    data = bpy.data.objects[name].data.shape_keys.animation_data
    return list(data.nla_tracks) if data else []


def markers(folder):
    """Propose, snap, mirror, nose tip, neutral."""
    chosen = example(folder)
    places = part("places")
    given = places.places_of(bpy.context.scene)
    left = next(o for o in chosen.places.objects if o["usdface_marker"] == "lip_corner_left")
    right = next(o for o in chosen.places.objects if o["usdface_marker"] == "lip_corner_right")
    surface = places.Surface(bpy.data.objects["head"])
    left.location.x += 0.002
    left.location.y += 0.004
    bpy.context.view_layer.update()
    bpy.ops.usdface.snap_markers()
    bpy.context.view_layer.update()
    on_face = min(np.linalg.norm(surface.points - np.array(left.location), axis=1))
    for item in bpy.data.objects:
        item.select_set(item == left)
    bpy.context.view_layer.objects.active = left
    bpy.ops.usdface.mirror_markers()
    mirrored = (np.array(left.location) * (-1, 1, 1) - np.array(right.location)).tolist()
    bpy.ops.usdface.choose_nose_tip()
    nose = chosen.nose_tip
    bpy.ops.usdface.drag_marker()
    bpy.context.scene.frame_set(12)
    bpy.ops.usdface.neutral_here()
    bpy.context.scene.frame_set(20)
    bpy.ops.usdface.neutral_here(extend=True)
    neutral = [chosen.neutral_start, chosen.neutral_end]
    for empty in list(chosen.places.objects):
        bpy.data.objects.remove(empty)
    chosen.nose_tip = ""
    refused = attempt(bpy.ops.usdface.propose)
    proposed = places.places_of(bpy.context.scene)
    distances = [
        float(np.linalg.norm(surface.points[proposed[n]] - surface.points[given[n]]))
        for n in given
        if n in proposed
    ]
    return {
        "given": len(given),
        "on face": float(on_face),
        "mirrored": mirrored,
        "nose": nose,
        "snap": list(bpy.context.scene.tool_settings.snap_elements_base),
        "neutral": neutral,
        "refused": refused,
        "proposed": distances,
        "kinds": sorted({o.empty_display_type for o in chosen.places.objects}),
    }


def lifecycle(folder):
    """Registered twice and removed, nothing is left."""

    all_handlers = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)]

    def state():
        return {
            "types": sorted(n for n in dir(bpy.types) if "usdface" in n.lower() or "Face" in n),
            "operators": [o for o in dir(bpy.ops.usdface)],
            "scene": hasattr(bpy.types.Scene, "usdface"),
            "handlers": sum(len(h) for h in all_handlers if isinstance(h, list)),
            "environment": dict(os.environ),
            "hooks": [
                c.__name__
                for c in bpy.types.USDHook.__subclasses__()
                if getattr(c, "is_registered", False)
            ],
        }

    addon_utils.disable(MODULE)
    before = state()
    during = []
    for _ in range(2):
        addon_utils.enable(MODULE)
        during.append(state())
        addon_utils.disable(MODULE)
    return {"before": before, "during": during, "after": state()}


def failing(folder):
    """A hook that fails leaves export and scene as they are without it, and says so."""
    import usdface

    chosen = example(folder)
    plain, failed = folder / "plain.usda", folder / "failed.usda"
    chosen.export_setup = False
    bpy.ops.wm.usd_export(filepath=str(plain))
    chosen.export_setup = True
    answer, objects = {}, sorted(o.name for o in bpy.data.objects)

    def crash(*_, **__):
        raise ZeroDivisionError("a mistake in the hook")

    there = usdface.__dict__.get("set_up", None)
    usdface.set_up = crash
    bpy.ops.wm.usd_export(filepath=str(failed))
    answer["crash"] = [messages(), same(plain, failed)]
    if there is None:
        del usdface.set_up
    else:
        usdface.set_up = there
    chosen.messages.clear()
    chosen.take_file = str(folder / "no such.c3d")
    bpy.ops.wm.usd_export(filepath=str(failed))
    answer["no take"] = [messages(), same(plain, failed)]
    chosen.messages.clear()
    chosen.take_file = str(EXAMPLES / "take.usdc")
    chosen.export_process = True
    worker = part("worker")
    python = worker.python
    worker.python = lambda: "/bin/false"
    bpy.ops.wm.usd_export(filepath=str(failed))
    worker.python = python
    answer["no process"] = [messages(), failed.exists()]
    answer["objects"] = objects == sorted(o.name for o in bpy.data.objects)
    chosen.messages.clear()
    bpy.ops.wm.usd_export(filepath=str(folder / "packed.usdz"))
    answer["usdz"] = [messages(), (folder / "packed.usdz").exists()]
    return answer


def same(one, other):
    """Whether two exports are equal; Blender numbers names of blend shapes as it comes."""
    from pxr import Sdf

    layers = [Sdf.Layer.OpenAsAnonymous(str(path)) for path in (one, other)]
    specs = []
    for layer in layers:
        paths = []
        layer.Traverse(layer.pseudoRoot.path, lambda path, paths=paths: paths.append(str(path)))
        specs.append(sorted(paths))
    return specs[0] == specs[1]


def worker(folder):
    """Blender goes on while the worker works; cancelled or killed, the scene stays as it was."""
    example(folder)
    process = part("process")
    running = part("worker")
    answer, scene = {}, bpy.context.scene

    def start():
        take, made = process.take_command(scene, process.work_folder(scene))
        shot = process.shot_command(scene, made, process.work_folder(scene))
        path = process.work_folder(scene) / "shot.usda"
        return running.Worker([take, shot, process.process_command(path)])

    work = start()
    looks, longest, steps, progress = 0, 0.0, set(), []
    while True:
        begin = time.perf_counter()
        goes_on = work.poll()
        longest = max(longest, time.perf_counter() - begin)
        scene.frame_set(looks % 50)  # the session is free meanwhile
        looks += 1
        steps.add(work.step)
        progress.append(work.progress)
        if not goes_on:
            break
        time.sleep(0.02)
    answer["ran"] = [looks, longest, sorted(steps), progress == sorted(progress), work.error]
    killed = start()
    while killed.step != "process: solve":
        killed.poll()
        time.sleep(0.02)
    os.kill(killed.process_id, signal.SIGKILL)
    killed.wait(time.sleep)
    answer["killed"] = killed.error
    left = start()
    while left.step != "process: solve":
        left.poll()
        time.sleep(0.02)
    number = left.process_id
    left.cancel()
    answer["cancelled"] = [left.error, left.poll(), alive(number)]
    answer["actions"] = len(bpy.data.actions)
    kill = running.Worker.poll

    def kill_in_solve(self):
        more = kill(self)
        if self.step == "process: solve" and self.process_id:
            os.kill(self.process_id, signal.SIGKILL)
        return more

    running.Worker.poll = kill_in_solve
    answer["operator"] = attempt(bpy.ops.usdface.process)
    running.Worker.poll = kill
    answer["after"] = [len(bpy.data.actions), messages(), bool(process.RUNNING)]
    answer["again"] = attempt(bpy.ops.usdface.process)
    return answer


def alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def bad(folder):
    """What goes wrong is said in Blender's way."""
    answer = {}
    empty_scene()
    process = bpy.ops.usdface.process
    settings().folder = str(folder / "work")
    settings().take_file = str(EXAMPLES / "take.usdc")
    answer["empty scene"] = attempt(process)
    answer["nothing selected"] = attempt(bpy.ops.usdface.choose_character)
    armature = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    bpy.context.scene.collection.objects.link(armature)
    settings().character = armature
    answer["armature without shape keys"] = attempt(process)
    bpy.context.view_layer.objects.active = armature
    answer["selected without shape keys"] = attempt(bpy.ops.usdface.choose_character)
    answer["no marker selected"] = attempt(bpy.ops.usdface.choose_nose_tip)
    answer["no result"] = attempt(bpy.ops.usdface.export_gltf, filepath=str(folder / "x.glb"))
    settings().result = str(folder / "gone.usda")
    answer["result that is gone"] = attempt(bpy.ops.usdface.load_result)
    chosen = example(folder)
    chosen.take_file = str(folder / "nothing.c3d")
    answer["no take"] = attempt(process)
    (folder / "broken.c3d").write_bytes(b"no C3D" * 99)
    chosen.take_file = str(folder / "broken.c3d")
    answer["broken take"] = attempt(process)
    chosen.take_kind = "EMPTIES"
    answer["no empties"] = attempt(process)
    chosen.take_markers = performer(animated=False)
    answer["empties without animation"] = attempt(process)
    bpy.ops.wm.usd_export(filepath=str(folder / "still.usda"), export_animation=True)
    answer["export of empties without animation"] = [messages(), (folder / "still.usda").exists()]
    chosen.messages.clear()
    chosen.take_kind, chosen.take_file = "FILE", str(EXAMPLES / "take.usdc")
    (folder / "file").write_text("in the way")
    chosen.folder = str(folder / "file" / "below")
    answer["folder that cannot be written"] = attempt(process)
    chosen.folder = str(folder / "work")
    first = next(iter(chosen.places.objects))
    home = first.location.copy()
    first.location.z += 5.0
    bpy.context.view_layer.update()
    answer["marker far off"] = attempt(process)
    first.location = home
    first["usdface_marker"] = "chin"
    bpy.context.view_layer.update()
    answer["marker twice"] = attempt(process)
    example(folder)
    bpy.ops.wm.usd_import(filepath=str(EXAMPLES / "head.usdc"))
    settings().character = None
    answer["two faces"] = attempt(process)
    bpy.ops.wm.usd_export(filepath=str(folder / "two.usda"))
    answer["export of two faces"] = [messages(), (folder / "two.usda").exists()]
    settings().messages.clear()
    settings().character = bpy.data.objects["Face"]
    answer["one of two faces"] = attempt(process)
    bpy.ops.wm.usd_export(filepath=str(folder / "rigid.usda"), export_shapekeys=False)
    answer["export without shape keys"] = [messages(), (folder / "rigid.usda").exists()]
    settings().messages.clear()
    bpy.data.objects["head"].modifiers.new("Half", "MIRROR")  # not exported with shape keys
    answer["modifier"] = attempt(process)
    extension = import_module(MODULE)
    extension.OLDEST = (99, 0, 0)
    try:
        extension.register()
        answer["old Blender"] = ""
    except RuntimeError as error:
        answer["old Blender"] = str(error)
    answer["alive"] = bpy.context.scene.name
    return answer


def hidden(folder):
    """A character that its flags hide, and one in a collection that is switched off."""
    chosen = example(folder)
    head = bpy.data.objects["head"]
    head.hide_select = head.hide_viewport = head.hide_render = True
    answer = {"flags": attempt(bpy.ops.usdface.process)}
    answer["kept"] = [head.hide_select, head.hide_viewport, head.hide_render]
    group = bpy.data.collections.new("off")
    bpy.context.scene.collection.children.link(group)
    bpy.context.scene.collection.objects.unlink(head)
    group.objects.link(head)
    bpy.context.view_layer.layer_collection.children["off"].exclude = True
    chosen.character = None
    answer["collection"] = attempt(bpy.ops.usdface.process)
    return answer


def schemas_too_late():
    from usdface.errors import SchemaError
    from usdface.schemas import register

    try:
        register()
    except SchemaError as error:
        return str(error)
    return "registered"


def late(folder):
    """Where USD has its schemas and no more can be added, export and Process work all the same."""
    from pxr import Usd

    Usd.Stage.CreateInMemory().DefinePrim("/a", "Xform")
    too_late = schemas_too_late()
    chosen = example(folder)
    bpy.ops.wm.usd_export(filepath=str(folder / "shot.usda"))
    exported = messages()
    refused = attempt(bpy.ops.usdface.process)
    return {"schemas": too_late, "messages": exported, "refused": refused, "result": chosen.result}


def real(folder):
    """An optical take onto ICT-FaceKit."""
    import usdface

    empty_scene()
    bpy.ops.wm.usd_import(filepath=str(folder / "rig.usdc"))
    chosen = settings()
    chosen.take_file, chosen.folder = str(folder / "take.usdc"), str(folder / "work")
    binding = json.loads((folder / "bind.json").read_text())
    part("places").show_places(bpy.context.scene, binding)
    begin = time.perf_counter()
    refused = attempt(bpy.ops.usdface.process)
    seconds = time.perf_counter() - begin
    result, _ = usdface.read_result(settings().result)
    shown = played(settings().first_frame, len(result.corrected.times))
    return {
        "refused": refused,
        "seconds": seconds,
        "difference": largest_difference(shown, result.corrected),
        "verdict": settings().verdict,
        "messages": messages(),
        "result": settings().result,
    }


if __name__ == "__main__":
    scenario, place, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    addon_utils.enable(MODULE)
    found = globals()[scenario](place)
    out.write_text(json.dumps(found), encoding="utf-8")
    addon_utils.disable(MODULE)
