"""The blend-shape checks as a validator of UsdValidation, for the tools that run those.

Where this folder is on PXR_PLUGINPATH_NAME, UsdValidation lists the validator
``usdface.io.usd.validation:BlendShapes`` beside USD's own and imports this module to run it;
elsewhere the import does the same. An error is named after the code of its finding.
"""

from pathlib import Path

from pxr import Plug, Sdf, Usd, UsdValidation

from usdface.findings import Finding
from usdface.io.usd.check import check_stage

__all__ = ["VALIDATOR", "validate"]

VALIDATOR = f"{__name__}:BlendShapes"  # plugin and validator, as plugInfo.json names them

_TYPES = {
    "error": UsdValidation.ValidationErrorType.Error,
    "warning": UsdValidation.ValidationErrorType.Warn,
    "info": UsdValidation.ValidationErrorType.Info,
}


def validate(
    stage: Usd.Stage, times: UsdValidation.ValidationTimeRange
) -> list[UsdValidation.ValidationError]:
    """Return the findings of `usdface.io.usd.check.check_stage` as UsdValidation has them.

    Weights are looked at in all their time samples, also outside of `times`.
    """
    return [_error(stage, found) for found in check_stage(stage)]


def _error(stage: Usd.Stage, found: Finding) -> UsdValidation.ValidationError:
    site = UsdValidation.ValidationErrorSite(stage, Sdf.Path(found.where))
    return UsdValidation.ValidationError(found.code, _TYPES[found.severity], [site], found.message)


Plug.Registry().RegisterPlugins(str(Path(__file__).parent))
UsdValidation.ValidationRegistry().RegisterPluginStageValidator(VALIDATOR, validate)
