"""What a script would want to tell apart has a code of its own."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import World, make_world

from usdface import errors
from usdface.arrays import FloatArray
from usdface.binding.resolve_binding import resolve_binding
from usdface.errors import ERROR_CODES, UsdFaceError
from usdface.face.fitted_setup import fit_setup
from usdface.io.bind_file import read_bind
from usdface.io.rigs.files import read_rig_file
from usdface.io.takes.files import read_take
from usdface.io.usd.rig_write import write_rig
from usdface.io.usd.take_write import write_take
from usdface.options import BindOptions, MapOptions, RigOptions, TakeOptions
from usdface.pipeline import calibrate, make_shot, process
from usdface.retarget.bound_points import BoundPoints
from usdface.retarget.solve_take import solve_take
from usdface.rigs import Rig
from usdface.setup.binding import Binding
from usdface.setup.retarget_setup import RetargetSetup, unbound
from usdface.takes import MarkerTake, WeightsTake

WORLD = make_world(head_moves=False)
MESH = WORLD.rig.face()
TAKE = WORLD.take
CSV = "time,a_x,a_y,a_z\n0,1,2,3\n0.1,1,2,3\n"
HEAD = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumMarkers\n30\t3\n"
TRC = HEAD + "Frame#\tTime\ta\tb\n\tX1\tY1\tZ1\n"


def setup(**changes: object) -> RetargetSetup:
    points = np.array(list(WORLD.points.values()))
    return replace(RetargetSetup(Binding(tuple(WORLD.points), points)), **changes)


def fitted(**changes: object) -> object:
    return fit_setup(setup(**changes), MESH, TAKE)


def solved(binding: RetargetSetup, take: MarkerTake = TAKE) -> object:
    points = binding.binding.points
    return solve_take(
        take,
        BoundPoints.linear(MESH.points[points], MESH.offsets_at(points), MESH.shape_names),
        binding,
    )


def proposed(positions: FloatArray, **options: object) -> object:
    names = tuple(f"m{i}" for i in range(positions.shape[1]))
    take = MarkerTake(names, TAKE.times, positions, TAKE.rate)
    return resolve_binding(WORLD.rig, take, None, options=BindOptions(**options))  # type: ignore[arg-type]


def text_take(folder: Path, text: str, name: str = "take.csv") -> object:
    (folder / name).write_text(text)
    return read_take(folder / name, TakeOptions())


def bound(folder: Path, document: object) -> object:
    path = folder / "bind.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return read_bind(path)


def rig_file(folder: Path, name: str) -> object:
    (folder / name).write_text("v 0 0 0\n")
    return read_rig_file(folder)


def calibrated(folder: Path, take: MarkerTake | WeightsTake, world: World = WORLD) -> object:
    world.write(folder)
    write_take(take, folder / "take.usda")
    bind = folder / "bind.json" if isinstance(take, MarkerTake) else None
    make_shot(folder / "rig.usda", folder / "take.usda", folder / "shot.usda", bind=bind)
    return calibrate(folder / "shot.usda", folder / "calibration.json")


def shot_of(folder: Path, name: str) -> object:
    WORLD.write(folder)
    (folder / "take.csv").write_text(CSV)
    return make_shot(folder / "rig.usda", folder / name, folder / "shot.usda")


def shot_of_strangers(folder: Path) -> object:
    WORLD.write(folder)
    write_take(replace(CURVES, names=tuple(f"c{i}" for i in range(12))), folder / "curves.usda")
    return make_shot(folder / "rig.usda", folder / "curves.usda", folder / "shot.usda")


def short(frames: int) -> MarkerTake:
    return replace(TAKE, times=TAKE.times[:frames], positions=TAKE.positions[:frames])


def without_shapes(folder: Path) -> object:
    write_rig(Rig("face", (replace(MESH, shapes=()),)), folder / "rig.usda")
    return read_rig_file(folder / "rig.usda")


def turned_away() -> object:
    """The face seen from behind."""
    mesh = replace(MESH, points=MESH.points * [-1.0, 1.0, -1.0])
    return resolve_binding(Rig("face", (mesh,)), TAKE, None, options=BindOptions())


IMAGE = MarkerTake(TAKE.names, TAKE.times, TAKE.positions[..., :2], TAKE.rate)
CURVES = WeightsTake(MESH.shape_names, TAKE.times, WORLD.weights, TAKE.rate)
FEW = Binding(TAKE.names[:3], np.array([WORLD.points[name] for name in TAKE.names[:3]]))

CASES: list[tuple[str, str, Callable[[Path], object]]] = [
    ("FILE_UNREADABLE", "no file", lambda f: read_take(f / "none.trc", TakeOptions())),
    ("FILE_UNREADABLE", "no text", lambda f: text_take(f, "a\0b")),
    ("FILE_UNREADABLE", "another kind", lambda f: text_take(f, "a", "take.trc")),
    ("FILE_UNREADABLE", "no JSON", lambda f: bound(f, "{")),
    ("FILE_KIND_UNKNOWN", "of a take", lambda f: text_take(f, "x", "take.fbx")),
    ("FILE_KIND_UNKNOWN", "of a rig", lambda f: read_rig_file(Path(__file__))),
    ("FILE_KIND_UNKNOWN", "no take as USD", lambda f: shot_of(f, "take.csv")),
    ("FILE_KIND_UNKNOWN", "a folder", lambda f: shot_of(f, "")),
    ("SHAPE_UNKNOWN", "of all curves", lambda f: shot_of_strangers(f)),
    ("ROW_WRONG", "no number", lambda f: text_take(f, CSV + "0.2,1,two,3\n")),
    ("ROW_WRONG", "twice", lambda f: text_take(f, "frame,marker,x,y\n1,a,1,2\n1,a,1,2\n")),
    ("COLUMNS_WRONG", "no markers", lambda f: text_take(f, "time,b\n0,1\n")),
    ("COLUMNS_WRONG", "no clock", lambda f: text_take(f, "marker,x,y\na,1,2\n")),
    ("COLUMNS_WRONG", "other count", lambda f: text_take(f, TRC, "take.trc")),
    ("TIMES_WRONG", "backwards", lambda f: text_take(f, CSV + "0.05,1,2,3\n")),
    ("TAKE_EMPTY", "no frames", lambda f: text_take(f, "time,a_x,a_y,a_z\n")),
    ("TAKE_EMPTY", "no markers", lambda f: replace(TAKE, names=(), positions=np.ones((40, 0, 3)))),
    ("UNIT_UNKNOWN", "of a take", lambda f: TakeOptions(units="furlong")),
    ("AXIS_UNKNOWN", "of a take", lambda f: TakeOptions(up_axis="X")),
    ("AXIS_UNKNOWN", "of a rig", lambda f: RigOptions(up_axis="X")),
    ("SETTING_WRONG", "dimension", lambda f: TakeOptions(dimension=4)),  # type: ignore[arg-type]
    ("SETTING_WRONG", "image size", lambda f: TakeOptions(image_size=(1920, -1080))),
    ("VALUES_WRONG", "image size", lambda f: replace(IMAGE, image_size=(0, 1080))),
    ("SETTING_WRONG", "no choice", lambda f: MapOptions(kernel="cubic")),
    ("SETTING_WRONG", "in a file", lambda f: bound(f, {"markers": {}, "map": {"radius": -1}})),
    ("SCHEMA_BROKEN", "of a binding", lambda f: bound(f, {"markers": {"a": 3}})),
    ("SCHEMA_BROKEN", "unknown key", lambda f: bound(f, {"markers": {}, "marker": 1})),
    ("NAME_REPEATED", "in a binding", lambda f: Binding(("a", "a"), np.zeros(2, int))),
    ("NAME_REPEATED", "in a take", lambda f: replace(TAKE, names=("a",) * len(TAKE.names))),
    ("NEUTRAL_UNKNOWN", "of a folder", lambda f: rig_file(f, "smile.obj")),
    ("SHAPES_MISSING", "in a file", without_shapes),
    ("MESH_UNKNOWN", "no such", lambda f: WORLD.rig.mesh("ear")),
    ("MESH_UNKNOWN", "two", lambda f: Rig("two", (MESH, replace(MESH, name="other"))).mesh()),
    ("SKIN_MISSING", "seen from behind", lambda f: turned_away()),
    ("SHAPE_UNKNOWN", "of neutral", lambda f: solved(setup(neutral_weights={"wag": 0.1}))),
    ("MARKER_UNKNOWN", "of the take", lambda f: TAKE.select(("ear",))),
    ("MARKER_UNKNOWN", "none bound", lambda f: fitted(binding=Binding(("a",), np.zeros(1, int)))),
    ("MARKER_UNKNOWN", "nose tip", lambda f: fitted(nose_tip="ear")),
    ("BINDING_MISSING", "none at all", lambda f: unbound(TAKE)),
    ("VERTEX_OUTSIDE", "of the mesh", lambda f: fitted(binding=replace(FEW, points=[0, 1, 10**6]))),
    ("FRAMES_OUTSIDE", "neutral", lambda f: fitted(neutral=(0, 400))),
    ("FRAMES_OUTSIDE", "peaks", lambda f: proposed(TAKE.positions, peaks=(900,))),
    ("MARKERS_TOO_FEW", "to solve", lambda f: solved(setup(binding=FEW))),
    ("MARKERS_TOO_FEW", "to propose", lambda f: proposed(TAKE.positions[:, :6])),
    ("TAKE_STILL", "to propose", lambda f: proposed(TAKE.positions[:1].repeat(40, axis=0))),
    ("TAKE_KIND_WRONG", "an image", lambda f: proposed(IMAGE.positions)),
    ("TAKE_KIND_WRONG", "of weights", lambda f: calibrated(f, CURVES)),
    ("TAKE_SHORT", "to calibrate", lambda f: calibrated(f, short(6))),
    ("SHOT_INCOMPLETE", "a rig", lambda f: process(WORLD.write(f) / "rig.usda")),
]


@pytest.mark.parametrize(
    ("code", "fails"), [(c, f) for c, _, f in CASES], ids=[f"{c}, {w}" for c, w, _ in CASES]
)
def test_an_error_has_the_code_of_its_cause(
    code: str, fails: Callable[[Path], object], tmp_path: Path
) -> None:
    with pytest.raises(UsdFaceError) as raised:
        fails(tmp_path)
    assert raised.value.code == code and code in ERROR_CODES, raised.value


def test_what_is_read_from_a_prim_keeps_the_code_of_its_cause(tmp_path: Path) -> None:
    folder = WORLD.write(tmp_path, map={"radius": 2.0})
    shot = folder / "shot.usda"
    make_shot(folder / "rig.usda", folder / "take.usda", shot, bind=folder / "bind.json")
    shot.write_text(shot.read_text().replace("map:radius = 2", "map:radius = -2"))
    with pytest.raises(errors.InputError, match="radius") as raised:
        process(shot)
    assert raised.value.code == "SETTING_WRONG"
