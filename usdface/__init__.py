"""usdface: facial retargeting in open formats.

Marker takes onto blend-shape characters in UsdSkel, with a fuzzy-logic expression layer, and
to and from glTF. The public names below are loaded when first asked for, so that
``import usdface`` costs next to nothing.
"""

from typing import TYPE_CHECKING

from usdface.lazy import lazy_names

if TYPE_CHECKING:
    from usdface.errors import InputError, OutputError, SchemaError, SolveError, UsdFaceError
    from usdface.expression_system import ExpressionSystem
    from usdface.fuzzy.system import FuzzySystem
    from usdface.pipeline import apply, process
    from usdface.retarget_setup import Binding, Expression, RetargetSetup
    from usdface.rigs import BlendShape, Mesh, Rig
    from usdface.takes import MarkerTake, WeightsTake

__version__ = "0.1.0"

__all__ = [
    "Binding",
    "BlendShape",
    "Expression",
    "ExpressionSystem",
    "FuzzySystem",
    "InputError",
    "MarkerTake",
    "Mesh",
    "OutputError",
    "RetargetSetup",
    "Rig",
    "SchemaError",
    "SolveError",
    "UsdFaceError",
    "WeightsTake",
    "apply",
    "process",
]

_HOMES = {
    "errors": ("InputError", "OutputError", "SchemaError", "SolveError", "UsdFaceError"),
    "expression_system": ("ExpressionSystem",),
    "fuzzy.system": ("FuzzySystem",),
    "pipeline": ("apply", "process"),
    "rigs": ("BlendShape", "Mesh", "Rig"),
    "retarget_setup": ("Binding", "Expression", "RetargetSetup"),
    "takes": ("MarkerTake", "WeightsTake"),
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
