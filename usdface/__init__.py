"""usdface: facial retargeting in open formats.

Marker takes onto blend-shape characters in UsdSkel, with a fuzzy-logic expression layer, and
to and from glTF. Arrays are in SI units, Y up::

    rig, _ = usdface.read_rig("head.usdc")
    take, _ = usdface.read_take("performance.c3d")
    bind, _ = usdface.read_bind("bind.json")
    shot, _ = usdface.assemble_shot(rig, take, setup=bind)
    result = usdface.retarget(shot)          # no file, no stage: a ShotResult of arrays

    usdface.process("shot.usda")             # the same from and to files
    usdface.apply(stage)                     # the same on a stage that a host holds open

The public names below are imported on first access, so that ``import usdface`` costs next to
nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from usdface.lazy import lazy_names

# The function `usdface.retarget` and the subpackage share a name. Python binds a subpackage to its
# parent once, when it is loaded: loaded here and unbound again, the name is the function's.
import_module("usdface.retarget")
del globals()["retarget"]

if TYPE_CHECKING:
    from usdface.errors import (
        Cancelled,
        InputError,
        OutputError,
        PluginError,
        SchemaError,
        SolveError,
        UsdFaceError,
    )
    from usdface.expression_system import ExpressionSystem
    from usdface.figures.peak_frames import peak_frames
    from usdface.findings import Finding, finding
    from usdface.formats import ExportTarget, RigReader, TakeReader
    from usdface.fuzzy.system import FuzzySystem
    from usdface.hooks import Hook
    from usdface.io.plugins import installed_hooks
    from usdface.io.takes.raw_take import RawTake, check_size, finish_take
    from usdface.options import (
        BindOptions,
        CleanOptions,
        ClosureOptions,
        CorrectionOptions,
        DeliverOptions,
        ExportOptions,
        FitOptions,
        ImportOptions,
        MapOptions,
        MarkerOptions,
        ProcessOptions,
        RigOptions,
        SolveOptions,
        TakeOptions,
        ViewOptions,
    )
    from usdface.pipeline import (
        apply,
        calibrate,
        check,
        check_neutral,
        conform,
        convert_fuzzy,
        explain,
        export_scene,
        fit_fuzzy,
        import_scene,
        list_formats,
        list_plugins,
        make_bind_page,
        make_markers,
        make_rig,
        make_shot,
        make_take,
        process,
        process_sequence,
        read_bind,
        read_result,
        read_rig,
        read_take,
        set_up,
        solve_pieces,
        view,
        write_paper_system,
    )
    from usdface.progress import Step
    from usdface.result import Result
    from usdface.rigs import BlendShape, Mesh, Rig
    from usdface.setup.binding import Binding
    from usdface.setup.calibration import Calibration
    from usdface.setup.expression import Expression
    from usdface.setup.performer_face import PerformerFace
    from usdface.setup.pin import Pin
    from usdface.setup.retarget_setup import RetargetSetup
    from usdface.shot.assembly import assemble_shot
    from usdface.shot.correct import correct
    from usdface.shot.explanation import Explanation, explain_result
    from usdface.shot.played_shot import PlayedShot
    from usdface.shot.residual_colours import residual_colours
    from usdface.shot.retarget import retarget
    from usdface.shot.shot import Shot, ShotResult
    from usdface.takes import MarkerTake, WeightsTake

__version__ = "0.1.0"

__all__ = [
    "BindOptions",
    "Binding",
    "BlendShape",
    "Calibration",
    "Cancelled",
    "CleanOptions",
    "ClosureOptions",
    "CorrectionOptions",
    "DeliverOptions",
    "Explanation",
    "ExportOptions",
    "ExportTarget",
    "Expression",
    "ExpressionSystem",
    "Finding",
    "FitOptions",
    "FuzzySystem",
    "Hook",
    "ImportOptions",
    "InputError",
    "MapOptions",
    "MarkerOptions",
    "MarkerTake",
    "Mesh",
    "OutputError",
    "PerformerFace",
    "Pin",
    "PlayedShot",
    "PluginError",
    "ProcessOptions",
    "RawTake",
    "Result",
    "RetargetSetup",
    "Rig",
    "RigOptions",
    "RigReader",
    "SchemaError",
    "Shot",
    "ShotResult",
    "SolveError",
    "SolveOptions",
    "Step",
    "TakeOptions",
    "TakeReader",
    "UsdFaceError",
    "ViewOptions",
    "WeightsTake",
    "apply",
    "assemble_shot",
    "calibrate",
    "check",
    "check_neutral",
    "check_size",
    "conform",
    "convert_fuzzy",
    "correct",
    "explain",
    "explain_result",
    "export_scene",
    "finding",
    "finish_take",
    "fit_fuzzy",
    "import_scene",
    "installed_hooks",
    "list_formats",
    "list_plugins",
    "make_bind_page",
    "make_markers",
    "make_rig",
    "make_shot",
    "make_take",
    "peak_frames",
    "process",
    "process_sequence",
    "read_bind",
    "read_result",
    "read_rig",
    "read_take",
    "residual_colours",
    "retarget",
    "set_up",
    "solve_pieces",
    "view",
    "write_paper_system",
]

_HOMES = {
    "errors": (
        "Cancelled",
        "InputError",
        "OutputError",
        "PluginError",
        "SchemaError",
        "SolveError",
        "UsdFaceError",
    ),
    "expression_system": ("ExpressionSystem",),
    "figures.peak_frames": ("peak_frames",),
    "findings": ("Finding", "finding"),
    "formats": ("ExportTarget", "RigReader", "TakeReader"),
    "fuzzy.system": ("FuzzySystem",),
    "hooks": ("Hook",),
    "io.plugins": ("installed_hooks",),
    "io.takes.raw_take": ("RawTake", "check_size", "finish_take"),
    "options": (
        "BindOptions",
        "CleanOptions",
        "ClosureOptions",
        "CorrectionOptions",
        "DeliverOptions",
        "ExportOptions",
        "FitOptions",
        "ImportOptions",
        "MapOptions",
        "MarkerOptions",
        "ProcessOptions",
        "RigOptions",
        "SolveOptions",
        "TakeOptions",
        "ViewOptions",
    ),
    "pipeline": (
        "apply",
        "calibrate",
        "check",
        "check_neutral",
        "conform",
        "convert_fuzzy",
        "explain",
        "export_scene",
        "fit_fuzzy",
        "import_scene",
        "list_formats",
        "list_plugins",
        "make_bind_page",
        "make_markers",
        "make_rig",
        "make_shot",
        "make_take",
        "process",
        "process_sequence",
        "read_bind",
        "read_result",
        "read_rig",
        "read_take",
        "set_up",
        "solve_pieces",
        "view",
        "write_paper_system",
    ),
    "progress": ("Step",),
    "result": ("Result",),
    "rigs": ("BlendShape", "Mesh", "Rig"),
    "setup.binding": ("Binding",),
    "setup.calibration": ("Calibration",),
    "setup.expression": ("Expression",),
    "setup.performer_face": ("PerformerFace",),
    "setup.pin": ("Pin",),
    "setup.retarget_setup": ("RetargetSetup",),
    "shot.assembly": ("assemble_shot",),
    "shot.correct": ("correct",),
    "shot.explanation": ("Explanation", "explain_result"),
    "shot.played_shot": ("PlayedShot",),
    "shot.residual_colours": ("residual_colours",),
    "shot.retarget": ("retarget",),
    "shot.shot": ("Shot", "ShotResult"),
    "takes": ("MarkerTake", "WeightsTake"),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
