"""usdface: facial retargeting in open formats.

Marker takes onto blend-shape characters in UsdSkel, with a fuzzy-logic expression layer, and
to and from glTF. The public names below are loaded when first asked for, so that
``import usdface`` costs next to nothing.
"""

from typing import TYPE_CHECKING

from usdface.lazy import lazy_names

if TYPE_CHECKING:
    from usdface.errors import (
        InputError,
        OutputError,
        PluginError,
        SchemaError,
        SolveError,
        UsdFaceError,
    )
    from usdface.findings import Finding, finding
    from usdface.formats import ExportTarget, RigReader, TakeReader
    from usdface.fuzzy.system import FuzzySystem
    from usdface.io.takes.raw_take import RawTake, check_size, finish_take
    from usdface.pipeline import apply, process
    from usdface.retarget_setup import Binding, Expression, RetargetSetup
    from usdface.rigs import BlendShape, Mesh, Rig
    from usdface.takes import MarkerTake, WeightsTake

__version__ = "0.1.0"

__all__ = [
    "Binding",
    "BlendShape",
    "ExportTarget",
    "Expression",
    "Finding",
    "FuzzySystem",
    "InputError",
    "MarkerTake",
    "Mesh",
    "OutputError",
    "PluginError",
    "RawTake",
    "RetargetSetup",
    "Rig",
    "RigReader",
    "SchemaError",
    "SolveError",
    "TakeReader",
    "UsdFaceError",
    "WeightsTake",
    "apply",
    "check_size",
    "finding",
    "finish_take",
    "process",
]

_HOMES = {
    "errors": (
        "InputError",
        "OutputError",
        "PluginError",
        "SchemaError",
        "SolveError",
        "UsdFaceError",
    ),
    "findings": ("Finding", "finding"),
    "formats": ("ExportTarget", "RigReader", "TakeReader"),
    "fuzzy.system": ("FuzzySystem",),
    "io.takes.raw_take": ("RawTake", "check_size", "finish_take"),
    "pipeline": ("apply", "process"),
    "rigs": ("BlendShape", "Mesh", "Rig"),
    "retarget_setup": ("Binding", "Expression", "RetargetSetup"),
    "takes": ("MarkerTake", "WeightsTake"),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
