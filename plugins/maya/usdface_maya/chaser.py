"""The export chaser: Maya's stage and options to `usdface_maya.shot.apply`.

Maya takes False from a chaser as the end of the whole export. An error of usdface is therefore
reported in Maya's way and the export goes on as it was, unless its option says ``on_error=stop``.
"""

from typing import Any

import mayaUsd.lib
from maya.api.OpenMaya import MGlobal

__all__ = ["NAME", "UsdfaceChaser", "register"]

NAME = "usdface"


class UsdfaceChaser(mayaUsd.lib.ExportChaser):
    """Retargets the exported face, after everything else is on the stage."""

    def __init__(self, factoryContext: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(factoryContext, *args, **kwargs)
        self._stage = factoryContext.GetStage()
        given = factoryContext.GetJobArgs().allChaserArgs
        self._options = dict(given[NAME]) if NAME in given else {}

    def ExportDefault(self) -> bool:
        """Nothing to do before the samples are there."""
        return True

    def ExportFrame(self, time: Any) -> bool:
        """Nothing to do for one frame."""
        return True

    def PostExport(self) -> bool:
        """Set up and retarget; False only where the user asked for it, and after saying why."""
        try:
            self._retarget()
        except Exception as error:  # whatever it is, it must not cost the export
            stop = self._options.get("on_error") == "stop"
            known = type(error).__module__.startswith("usdface")
            message = f"{'' if known else f'{type(error).__name__}: '}{error}"
            outcome = "the export is stopped" if stop else "the face is exported without it"
            MGlobal.displayError(f"usdface: {message} ({outcome})")
            return not stop
        return True

    def _retarget(self) -> None:
        from usdface_maya.shot import SETUP, apply

        result = apply(self._stage, self._options)
        for finding in result.findings:
            if finding.severity != "info":
                MGlobal.displayWarning(
                    f"usdface: {finding.code}: {finding.message} ({finding.where})"
                )
        scope = self._options.get("scope", SETUP)
        if self._stage.GetPrimAtPath(scope) and hasattr(self, "RegisterExtraPrimsPaths"):
            self.RegisterExtraPrimsPaths([scope])
        level = result.verdict.level.replace("_", " ") if result.verdict else "done"
        MGlobal.displayInfo(f"usdface: {result.summary['frames']} frames, verdict: {level}")


def register() -> None:
    """Make the chaser known to Maya's USD export; again has no effect."""
    mayaUsd.lib.ExportChaser.Register(UsdfaceChaser, NAME)
