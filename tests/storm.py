"""Pictures of a stage by Storm, USD's own renderer, without a display: a script for Xvfb.

usd-core has no imaging; the pxr that Blender's module bundles has (UsdImagingGL, Storm). `command`
makes the call: Xvfb, that pxr in front of ours, Qt for the OpenGL context. Blender is not imported.
"""

import os
import shutil
import sys
from pathlib import Path
from typing import Any

from checkout import CHECKOUT, environment

__all__ = ["StormView", "command"]

_GROUND = (0.16, 0.165, 0.18)


def command(script: Path, *arguments: object) -> tuple[list[str], dict[str, str]] | str:
    """Return the call of a script and its environment, or why it cannot be made."""
    places = (CHECKOUT / ".venv-blender", Path(os.environ.get("USDFACE_BLENDER_ENV", "/nowhere")))
    found = [
        path
        for place in places
        for path in place.glob(
            "lib/python3.*/site-packages/bpy/*/python/lib/python3.*/site-packages"
        )
        if f"python{sys.version_info.major}.{sys.version_info.minor}" in str(path)
    ]
    if not found:
        return "no Blender module for this Python in .venv-blender: Storm comes from its pxr"
    if not shutil.which("xvfb-run"):
        return "no xvfb-run: the Debian packages xvfb and xauth"
    own = environment(
        *(found[0], CHECKOUT / "plugins" / "usdview", CHECKOUT / "tests"),
        LIBGL_ALWAYS_SOFTWARE="1",
        QT_QPA_PLATFORM="xcb",
        PXR_PLUGINPATH_NAME="",
    )
    screen = ["xvfb-run", "-a", "-s", "-screen 0 1600x1200x24"]
    return [*screen, sys.executable, str(script), *map(str, arguments)], own


class StormView:
    """A viewport on a stage: Storm in a framebuffer, a light at the camera, as in usdview.

    Parameters
    ----------
    stage : Usd.Stage
    size : int
        Width and height [px].
    height : float
        Height of the picture at the face, in heights of the face.
    """

    def __init__(self, stage: Any, size: int, height: float = 1.25) -> None:
        from pxr import Gf, Usd, UsdGeom, UsdImagingGL, UsdSkel
        from PySide6 import QtGui, QtOpenGL

        self._surface, self._context = QtGui.QOffscreenSurface(), QtGui.QOpenGLContext()
        self._surface.create()
        assert self._context.create() and self._context.makeCurrent(self._surface)
        layout = QtOpenGL.QOpenGLFramebufferObjectFormat()
        layout.setAttachment(QtOpenGL.QOpenGLFramebufferObject.CombinedDepthStencil)
        self._buffer = QtOpenGL.QOpenGLFramebufferObject(size, size, layout)
        self._engine, self._stage, self._size = UsdImagingGL.Engine(), stage, size
        (face,) = (prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root))
        bounds = UsdGeom.BBoxCache(Usd.TimeCode(stage.GetStartTimeCode()), ["default"])
        box = bounds.ComputeWorldBound(face).ComputeAlignedRange()
        away = height * box.GetSize()[1] / (2.0 * 0.268)  # half of 30 degrees
        at = box.GetMidpoint() + Gf.Vec3d(0.0, 0.0, away)
        camera = Gf.Camera(Gf.Matrix4d().SetTranslate(at))
        camera.SetPerspectiveFromAspectRatioAndFieldOfView(1.0, 30.0, Gf.Camera.FOVVertical)
        camera.clippingRange = Gf.Range1f(0.01 * away, 10.0 * away)
        self._frustum, self._eye = camera.frustum, at

    def draw(self, code: float) -> Any:
        """Return a picture (QImage) of the stage at a time code."""
        from pxr import Gf, Glf, Tf, Usd, UsdImagingGL

        self._context.makeCurrent(self._surface)
        self._buffer.bind()
        gl = self._context.functions()
        gl.glViewport(0, 0, self._size, self._size)
        gl.glClearColor(*_GROUND, 1.0)
        gl.glClear(0x4100)  # colour and depth
        engine = self._engine
        engine.SetRendererAov("color")
        engine.SetRenderViewport(Gf.Vec4d(0, 0, self._size, self._size))
        engine.SetCameraState(
            self._frustum.ComputeViewMatrix(), self._frustum.ComputeProjectionMatrix()
        )
        light = Glf.SimpleLight()
        light.position = Gf.Vec4f(*self._eye, 1.0)
        ambient = Gf.Vec4f(0.08, 0.08, 0.08, 1.0)
        engine.SetLightingState([light], Glf.SimpleMaterial(), ambient)
        parameters = UsdImagingGL.RenderParams()
        parameters.frame = Usd.TimeCode(code)
        parameters.complexity = 1.1
        parameters.clearColor = Gf.Vec4f(*_GROUND, 1.0)
        for _ in range(100):
            try:
                engine.Render(self._stage.GetPseudoRoot(), parameters)
            except Tf.ErrorException:  # as usdview: a face that is rebuilt is named once, and drawn
                continue
            if engine.IsConverged():
                break
        image = self._buffer.toImage()
        self._buffer.release()
        return image
