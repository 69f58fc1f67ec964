"""Registers the usdface chaser when Maya starts: on PYTHONPATH, or from a userSetup of yours.

Not run in Maya; read against maya-usd's sources and tests.
"""

from maya import cmds
from maya.api.OpenMaya import MGlobal


def register_usdface() -> None:
    """Load Maya's USD plug-in and register the chaser; a failure is said and Maya starts."""
    try:
        cmds.loadPlugin("mayaUsdPlugin", quiet=True)
        from usdface_maya.chaser import register

        register()
    except Exception as error:  # Maya must start
        MGlobal.displayWarning(f"usdface is not registered: {type(error).__name__}: {error}")


cmds.evalDeferred(register_usdface)
