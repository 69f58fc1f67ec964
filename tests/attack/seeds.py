"""Good files of every format, as small as they can be, and all that reads them."""

import base64
import contextlib
import io
import json
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from camera_worlds import (
    make_cameras,
    moving_points,
    project_all,
    write_json,
    write_stereo_yaml,
    write_toml,
)
from track_writers import SIZE, TRACKS, WRITERS
from worlds import make_world

from usdface.cli import main as usdface

__all__ = ["SECRET", "Seed", "make_seeds"]

Reader = Callable[[Path], Any]

SECRET = b"secret of another folder"
_OUT, _GLB = ("-o", "OUT/x.usda"), ("-o", "OUT/x.glb")
_PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJg"
    "gg=="
)


@dataclass(frozen=True)
class Seed:
    """A good file and what reads it.

    In commands `FILE` is the spoilt file, `FOLDER` its folder, `OUT` a folder for results. `share`
    is how many of them are spoilt in a round.
    """

    name: str
    file: Path
    kind: str
    readers: tuple[Reader, ...]
    commands: tuple[tuple[str, ...], ...]
    share: int = 100

    @property
    def data(self) -> bytes:
        return self.file.read_bytes()


def make_seeds(place: Path) -> list[Seed]:
    """Write a good file of every format into a folder, with what they name beside them."""
    from every_term import SYSTEMS
    from pxr import Sdf

    from usdface.io.fuzzy_formats.files import write_fuzzy_file
    from usdface.io.gltf.read import read_gltf
    from usdface.io.usd.rig_write import write_rig

    make_world().write(place)
    given = (f"--rig={place}/rig.usda", f"--take={place}/take.usda", f"--bind={place}/bind.json")
    _run("shot", *given, "-o", f"{place}/shot.usda")
    _write_small_gltf(place)
    rig, clips, _ = read_gltf(place / "small.gltf")
    write_rig(rig, place / "small.usda", clips)
    _run("export", f"{place}/small.usda", "-o", f"{place}/small.usdz")
    _run("take", f"{place}/take.usda", "-o", f"{place}/clip.usda")
    for name in ("small", "clip"):
        Sdf.Layer.FindOrOpen(str(place / f"{name}.usda")).Export(str(place / f"{name}.usdc"))
    for name in ("mamdani", "default"):
        for suffix in (".fis", ".fcl", ".fll", ".usda"):
            write_fuzzy_file(place / f"{name}{suffix}", SYSTEMS[name])
    _write_takes(place)
    _write_tracks(place)
    _write_cameras(place)
    _write_tables(place)
    _write_images(place)
    return list(_seeds(place))


def _run(*words: str) -> None:
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):
        if usdface(words) == 0:
            return
    raise RuntimeError(f"the seed cannot be made: {words}")


def _write_small_gltf(place: Path) -> None:
    """Write four vertices with two morph targets, a joint, a texture and an animation."""
    parts: list[bytes] = []
    views, accessors = [], []

    def add(values: Any, kind: str, component: int = 5126, bounds: bool = False) -> int:
        array = np.asarray(values, {5126: "<f4", 5121: "u1", 5123: "<u2"}[component])
        data = array.tobytes() + b"\0" * (-array.nbytes % 4)
        offset = sum(map(len, parts))
        parts.append(data)
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": array.nbytes})
        accessor = {"bufferView": len(views) - 1, "componentType": component, "type": kind}
        accessor["count"] = array.size if kind == "SCALAR" else len(array)
        if bounds:
            flat = array.reshape(accessor["count"], -1)
            accessor |= {"min": flat.min(0).tolist(), "max": flat.max(0).tolist()}
        accessors.append(accessor)
        return len(accessors) - 1

    square = [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]]
    attributes = {
        "POSITION": add(square, "VEC3", bounds=True),
        "NORMAL": add([[0, 0, 1]] * 4, "VEC3"),
        "TEXCOORD_0": add([[0, 0], [1, 0], [0, 1], [1, 1]], "VEC2"),
        "JOINTS_0": add([[0, 0, 0, 0]] * 4, "VEC4", 5121),
        "WEIGHTS_0": add([[1, 0, 0, 0]] * 4, "VEC4"),
    }
    targets = [
        {"POSITION": add([[0, 0, 0], [0, 0, d], [0, d, 0], [0, 0, 0]], "VEC3", bounds=True)}
        for d in (0.01, -0.02)
    ]
    primitive = {
        "attributes": attributes,
        "indices": add([0, 1, 2, 2, 1, 3], "SCALAR", 5123),
        "material": 0,
        "targets": targets,
    }
    times = add([0.0, 0.5, 1.0], "SCALAR", bounds=True)
    weights = add([0, 0, 1, 0.5, 0, 1], "SCALAR")
    inverse = add([np.eye(4)], "MAT4")
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "face", "mesh": 0, "skin": 0}, {"name": "head"}],
        "meshes": [
            {"primitives": [primitive], "extras": {"targetNames": ["jawOpen", "mouthSmileLeft"]}}
        ],
        "skins": [{"joints": [1], "inverseBindMatrices": inverse}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "skin.png"}],
        "animations": [{"channels": [channel], "samplers": [{"input": times, "output": weights}]}],
        "accessors": accessors,
        "bufferViews": views,
    }
    data = b"".join(parts)
    (place / "small.bin").write_bytes(data)
    (place / "skin.png").write_bytes(_PNG)
    buffers = [{"uri": "small.bin", "byteLength": len(data)}]
    (place / "small.gltf").write_text(json.dumps(document | {"buffers": buffers}))
    embedded = {
        "buffers": [{"byteLength": len(data)}],
        "images": [{"uri": "data:image/png;base64," + base64.b64encode(_PNG).decode()}],
    }
    text = json.dumps(document | embedded).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(data), 0x004E4942) + data
    (place / "small.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def _write_takes(place: Path) -> None:
    import ezc3d

    rng = np.random.default_rng(0)
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [60.0]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["a", "b", "c"]
    file["data"]["points"] = np.concatenate([rng.normal(size=(3, 3, 20)), np.ones((1, 3, 20))])
    file.write(str(place / "take.c3d"))
    rows = ["time,a_x,a_y,a_z,b_x,b_y,b_z"]
    rows += [f"{n / 60},1,2,{n % 5},4,5,{n % 7}" for n in range(20)]
    (place / "wide.csv").write_text("\n".join(rows) + "\n")
    (place / "motive.csv").write_text(
        "Format Version,1.23,Take Name,smile,Capture Frame Rate,120,Export Frame Rate,120,"
        "Capture Start Time,2024-05-06 11.59.58.500 PM,Total Exported Frames,4,"
        "Length Units,Meters\n\n,Type,Marker,Marker,Marker\n,Name,Face:Chin,Face:Chin,Face:Chin\n"
        ",ID,2,2,2\n,,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z\n"
        + "".join(f"{n},{n / 120:.6f},0.1,0.{n},0.3\n" for n in range(4))
    )
    (place / "vicon.csv").write_text(
        "Events\n100\nSubject,Context,Name,Time (s)\nFace,Left,Blink,0.5\n\n"
        "Trajectories\n100\n,,Face:Chin,,,Face:Nose,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n"
        ",,mm,mm,mm,mm,mm,mm\n" + "".join(f"{n},0,1,2,{n},4,5,{n % 3}\n" for n in range(1, 9))
    )
    (place / "qualisys.tsv").write_text(
        "NO_OF_FRAMES\t8\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nDATA_INCLUDED\t3D\n"
        "MARKER_NAMES\tChin\tNose\nTRAJECTORY_TYPES\tMeasured\tMeasured\n"
        + "".join(f"{n}\t{n / 100}\t1\t2\t{n}\t4\t5\t{n % 3}\n" for n in range(1, 9))
    )
    rows = ["frame,marker,x,y,z"]
    rows += [f"{n},{m},{n % 3},2,{n % 5}" for n in range(20) for m in "ab"]
    (place / "long.csv").write_text("\n".join(rows) + "\n")
    rows = [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        "60\t60\t20\t2\tmm\t60\t1\t20",
        "Frame#\tTime\ta\t\t\tb\t\t",
        "\t\tX1\tY1\tZ1\tX2\tY2\tZ2",
        "",
        *(f"{n + 1}\t{n / 60:.5f}\t1\t2\t{n % 5}\t4\t5\t{n % 7}" for n in range(20)),
    ]
    (place / "take.trc").write_text("\n".join(rows) + "\n")
    (place / "take.bvh").write_text(
        "HIERARCHY\nROOT hips\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition "
        "Zrotation Xrotation Yrotation\n JOINT head\n {\n  OFFSET 0 10 0\n  CHANNELS 3 Zrotation "
        "Xrotation Yrotation\n  End Site\n  {\n   OFFSET 0 1 0\n  }\n }\n}\nMOTION\nFrames: 5\n"
        "Frame Time: 0.0333333\n" + "0 1 2 3 4 5 6 7 8\n" * 5
    )
    rows = ["Timecode,BlendShapeCount,JawOpen,EyeBlinkLeft,BrowInnerUp,HeadYaw"]
    rows += [f"10:00:00:{2 * n:02}.5,4,0.{n},0.2,0.{n % 7},0" for n in range(20)]
    (place / "livelink.csv").write_text("\n".join(rows) + "\n")


def _write_tracks(place: Path) -> None:
    """Write 2D tracks in every format; `_read_tracks` gives the size of the image."""
    for name, writer in WRITERS.items():
        (place / (name + Path(writer.file).suffix)).write_text(writer.write(TRACKS))


def _write_cameras(place: Path) -> None:
    """Write the tracks of two cameras, and their calibration in every form."""
    cameras = make_cameras(2)
    for n, pixels in enumerate(project_all(cameras, moving_points(5, 3))):
        rows = ["frame,a_x,a_y,b_x,b_y,c_x,c_y"]
        rows += [",".join(map(str, (f, *row))) for f, row in enumerate(pixels.reshape(5, 6))]
        (place / f"camera{n}.csv").write_text("\n".join(rows) + "\n")
    (place / "stereo.yml").write_text(write_stereo_yaml(cameras))
    (place / "cameras.json").write_text(write_json(cameras))
    (place / "cameras.toml").write_text(write_toml(cameras))


def _write_tables(place: Path) -> None:
    """Write tables and JSON of our own, meshes, and secrets in the folder above."""
    for name, moved in (("neutral", 1), ("jawOpen", 2)):
        text = f"v 0 0 0\nv 1 0 0\nv 0 {moved} 0\nv 1 1 0\nf 1 2 3\nf 3 2 4\n"
        (place / f"{name}.obj").write_text(text)
    (place / "combinations.json").write_text('{"both": ["jawOpen", "both"]}')
    (place / "expressions.json").write_text(
        '{"contempt": {"units": {"12L": 0.3, "14L": 0.9}}, "joy": {"shapes": {"jawOpen": 0.4}}}'
    )
    (place / "calibration.json").write_text(
        '{"shapes": {"jawOpen": {"gain": 1.2, "deviation": 0.1, "peak": 0.9, "offset": 0.01}}}'
    )
    (place / "labels.csv").write_text(
        "take,start_s,end_s,emotion,variant,intensity\nwide.csv,0,0.1,anger,a,1\n"
        "wide.csv,0.1,0.2,neutral,,\n"
    )
    (place / "labels.json").write_text(
        '[{"take": "wide.csv", "start_frame": 0, "end_frame": 4, "emotion": "joy"}]'
    )
    above = place.parent
    (above / "secret.png").write_bytes(_PNG[:-12] + SECRET)
    (above / "secret.bin").write_bytes(SECRET * 200)


def _write_images(place: Path) -> None:
    import OpenImageIO as oiio

    pixels = np.linspace(0, 1, 8 * 8 * 3, dtype=np.float32).reshape(8, 8, 3)
    for suffix, kind in (
        (".png", "uint16"),
        (".tif", "uint8"),
        (".exr", "half"),
        (".webp", "uint8"),
    ):
        output = oiio.ImageOutput.create(str(place / f"image{suffix}"))
        output.open(str(place / f"image{suffix}"), oiio.ImageSpec(8, 8, 3, kind))
        output.write_image(pixels)
        output.close()


def _seeds(place: Path) -> Iterator[Seed]:
    from usdface.io.bind_file import read_bind
    from usdface.io.calibration_file import read_calibration_file
    from usdface.io.check import check_file
    from usdface.io.expressions_file import read_expressions_file
    from usdface.io.fuzzy_formats.files import read_fuzzy_file
    from usdface.io.gltf.read import read_gltf
    from usdface.io.labels_file import read_labels
    from usdface.io.rigs.files import read_rig_file
    from usdface.io.takes.files import read_take

    take = (("take", "FILE", *_OUT),)
    for name in (
        "take.c3d",
        "motive.csv",
        "vicon.csv",
        "qualisys.tsv",
        "wide.csv",
        "long.csv",
        "take.trc",
        "take.bvh",
        "livelink.csv",
    ):
        kind = "binary" if name.endswith("c3d") else "text"
        yield Seed(name, place / name, kind, (read_take,), take, 1500)
    sized = (("take", "FILE", "--image-size", "1920", "1080", *_OUT),)
    for name, writer in WRITERS.items():
        file = place / (name + Path(writer.file).suffix)
        kind = "json" if file.read_text().startswith("{") else "text"
        yield Seed(name, file, kind, (_read_tracks,), sized, 500)
    views = tuple(str(place / f"camera{n}.csv") for n in (0, 1))
    for name in ("stereo.yml", "cameras.json", "cameras.toml"):
        kind = "json" if name.endswith("json") else "text"
        command = ("take", *views, "--cameras", "FILE", *_OUT)
        yield Seed(name, place / name, kind, (_read_views(views),), (command,), 1000)
    yield Seed("clip.usda", place / "clip.usda", "text", (read_take,), take, 60)
    yield Seed("clip.usdc", place / "clip.usdc", "binary", (read_take,), take, 60)
    scene = (("rig", "FILE", *_OUT), ("export", "FILE", *_GLB), ("check", "FILE"))
    usd = (read_rig_file, check_file, _read_scene)
    yield Seed("small.usda", place / "small.usda", "text", usd, scene, 60)
    for name in ("small.usdc", "small.usdz"):
        yield Seed(name, place / name, "binary", usd, scene, 60)
    scene = (("rig", "FILE", *_OUT), ("import", "FILE", *_OUT), ("check", "FILE"))
    gltf = (read_rig_file, check_file, read_gltf)
    yield Seed("small.gltf", place / "small.gltf", "json", gltf, scene, 400)
    yield Seed("small.glb", place / "small.glb", "glb", gltf, scene, 400)
    folder = (("rig", "FOLDER", *_OUT),)
    for name in ("jawOpen.obj", "combinations.json"):
        kind = "json" if name.endswith("n") else "text"
        yield Seed(name, place / name, kind, (_read_folder,), folder, 400)
    shot = tuple(f"--{n}={place / n}.usda" for n in ("rig", "take"))
    shot = ("shot", *shot, *_OUT)
    bound = (*shot, f"--bind={place / 'bind.json'}")
    yield Seed(
        "bind.json", place / "bind.json", "json", (read_bind,), ((*shot, "--bind", "FILE"),), 1200
    )
    for option, reader in (
        ("expressions", read_expressions_file),
        ("calibration", read_calibration_file),
    ):
        file = place / f"{option}.json"
        yield Seed(file.name, file, "json", (reader,), ((*bound, f"--{option}", "FILE"),), 1200)
    for name in ("labels.csv", "labels.json"):
        kind = "json" if name.endswith("n") else "text"
        yield Seed(name, place / name, kind, (read_labels,), (), 1000)
    process = (("process", "FILE", *_OUT),)
    yield Seed("shot.usda", place / "shot.usda", "text", (_read_shot,), process, 40)
    for name in ("mamdani", "default"):
        for suffix, share in ((".fis", 1200), (".fcl", 1200), (".fll", 1200), (".usda", 40)):
            file = place / f"{name}{suffix}"
            convert = ("fuzzy", "convert", "FILE", "-o", "OUT/x.fll")
            yield Seed(file.name, file, "text", (read_fuzzy_file,), (convert,), share)
    for suffix in (".png", ".tif", ".exr", ".webp"):
        yield Seed(f"image{suffix}", place / f"image{suffix}", "binary", (_read_image,), (), 400)


def _read_tracks(path: Path) -> Any:
    from usdface.io.takes.files import read_take
    from usdface.options import TakeOptions

    return read_take(path, TakeOptions(image_size=SIZE))


def _read_views(views: tuple[str, ...]) -> Reader:
    def read(path: Path) -> Any:
        from usdface.io.takes.camera_views import read_views
        from usdface.options import TakeOptions

        return read_views([Path(view) for view in views], path, TakeOptions())

    return read


def _read_scene(path: Path) -> Any:
    from usdface.io.usd.clips import animated_rig
    from usdface.io.usd.stage import open_stage

    return animated_rig(open_stage(path))


def _read_folder(path: Path) -> Any:
    from usdface.io.rigs.files import read_rig_file

    return read_rig_file(path.parent)


def _read_shot(path: Path) -> Any:
    from usdface.io.usd.shot import read_shot
    from usdface.io.usd.stage import open_stage

    return read_shot(open_stage(path), str(path))


def _read_image(path: Path) -> Any:
    from usdface.io.gltf.image import to_gltf_image
    from usdface.materials import Texture

    return to_gltf_image(Texture(path=str(path), suffix=path.suffix))
