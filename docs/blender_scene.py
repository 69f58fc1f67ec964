"""Run by Blender's own Python: the example, rendered, and the panel, as JSON.

blender_scene.py FOLDER
"""

import json
import sys
from importlib import import_module
from pathlib import Path

import bpy

MODULE = "bl_ext.user_default.usdface"
EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SIZE = (520, 620)
FRAME = 73  # joy
MARKER = (0.10, 0.55, 0.95, 1)


def main(folder: Path) -> None:
    """Do what a user does, and take the pictures."""
    import_module("addon_utils").enable(MODULE)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(EXAMPLES / "head.usdc"))
    scene = bpy.context.scene
    settings = scene.usdface
    settings.character = bpy.data.objects["Face"]
    settings.take_file = str(EXAMPLES / "performance.trc")
    settings.folder = str(folder / "work")
    places = import_module(f"{MODULE}.places")
    places.show_places(scene, json.loads((EXAMPLES / "bind.json").read_text()))
    bpy.context.view_layer.update()
    panels = {"before": panels_drawn()}
    light()
    spheres = marker_spheres(places.empties_of(settings.places))
    render(folder / "markers.png")
    for sphere in spheres:
        sphere.hide_render = True
    bpy.ops.usdface.process()
    scene.frame_set(FRAME)
    for influence, name in ((0.0, "raw"), (1.0, "expressive")):
        settings.influence = influence
        scene.frame_set(FRAME)
        render(folder / f"{name}.png")
    panels["after"] = panels_drawn()
    (folder / "panels.json").write_text(json.dumps(panels), encoding="utf-8")


def light() -> None:
    """Set the camera and Workbench's look."""
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "Standard"
    scene.display.shading.light = "STUDIO"
    scene.display.shading.color_type = "MATERIAL"
    scene.display.shading.background_type = "VIEWPORT"
    scene.display.shading.background_color = (0.05, 0.05, 0.06)
    scene.render.film_transparent = True
    for material in bpy.data.materials:  # Workbench knows one colour, not nodes
        for node in material.node_tree.nodes if material.node_tree else ():
            if node.type == "BSDF_PRINCIPLED":
                material.diffuse_color = node.inputs["Base Color"].default_value
    head = bpy.data.objects["head"]
    corners = [head.matrix_world @ v.co for v in head.data.vertices]
    middle = [(min(c[i] for c in corners) + max(c[i] for c in corners)) / 2 for i in range(3)]
    height = max(c[2] for c in corners) - min(c[2] for c in corners)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.12 * height
    camera.location = (middle[0], middle[1] - 4 * height, middle[2])
    camera.rotation_euler = (1.5707963, 0, 0)
    camera.data.clip_end = 100
    scene.collection.objects.link(camera)
    scene.camera = camera


def marker_spheres(empties: list) -> list:
    """Make spheres where markers are: empties are drawn in the viewport, not in renders."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.0022)
    first = bpy.context.object
    blue = bpy.data.materials.new("marker")
    blue.diffuse_color = MARKER
    first.data.materials.append(blue)
    made = [first]
    for empty in empties:
        sphere = bpy.data.objects.new("marker sphere", first.data)
        bpy.context.scene.collection.objects.link(sphere)
        sphere.location = empty.matrix_world.translation
        made.append(sphere)
    first.hide_render = True
    return made


def render(path: Path) -> None:
    """Render one picture."""
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


class Layout:
    """A stand-in of Blender's layout: takes down what a panel draws."""

    def __init__(self, across: bool = False) -> None:
        self.items, self.across, self.active = [], across, True

    def row(self, **_: object) -> "Layout":
        """Begin a row."""
        return self._child(across=True)

    def column(self, **_: object) -> "Layout":
        """Begin a column."""
        return self._child()

    box = column

    def _child(self, across: bool = False) -> "Layout":
        child = Layout(across)
        self.items.append(child)
        return child

    def prop(self, data: object, name: str, text: str | None = None, **more: object) -> None:
        """Take a property down."""
        kind, value = data.bl_rna.properties[name], getattr(data, name)
        label = kind.name if text is None else text
        if kind.type == "ENUM" and more.get("expand"):
            for choice in kind.enum_items:
                on = choice.identifier == value
                self.items.append({"tab": choice.name, "on": on})
        elif kind.type == "BOOLEAN":
            self.items.append({"check": label, "on": value})
        elif kind.type in ("FLOAT", "INT"):
            shown = f"{value:.3f}" if kind.type == "FLOAT" else str(value)
            low, high = getattr(kind, "soft_min", 0), getattr(kind, "soft_max", 1)
            share = (value - low) / (high - low) if more.get("slider") else 0
            self.items.append({"number": label, "value": shown, "share": share})
        else:
            shown = value.name if hasattr(value, "name") else Path(str(value or "")).name
            self.items.append({"field": label, "value": shown})

    def label(self, text: str = "", icon: str = "NONE") -> None:
        """Take a line down."""
        self.items.append({"label": text})

    def operator(self, name: str, text: str | None = None, **_: object) -> object:
        """Take a button down."""
        group, operator = name.split(".")
        kind = getattr(getattr(bpy.ops, group), operator).get_rna_type()
        self.items.append({"button": kind.name if text is None else text})
        return type("Properties", (), {})()

    def plain(self) -> dict:
        """Return all as plain values."""
        items = [i.plain() if isinstance(i, Layout) else i for i in self.items]
        return {"across": self.across, "items": items}


def panels_drawn() -> list:
    """Return what each panel draws."""
    drawn = []
    for kind in import_module(f"{MODULE}.panel").PANELS:
        if hasattr(kind, "poll") and not kind.poll(bpy.context):
            continue
        methods = {
            name: value
            for name, value in vars(kind).items()
            if callable(value) and name.startswith("_") and not name.startswith("__")
        }
        panel = type("Panel", (), methods | {"layout": Layout()})()
        kind.draw(panel, bpy.context)
        drawn.append({"title": kind.bl_label, "layout": panel.layout.plain()})
    return drawn


if __name__ == "__main__":
    main(Path(sys.argv[1]))
