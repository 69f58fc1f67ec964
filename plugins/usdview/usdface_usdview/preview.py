"""Results over an open stage, in a layer of our own below its session layer.

No layer of the user's is edited: the session layer gets one anonymous sublayer, which holds all
that is shown and is taken out again. Neither Qt nor usdview is needed here.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

__all__ = ["Preview", "shot_file"]

_SETUP = "UsdFaceRetarget"
_MATERIAL = Sdf.Path("/usdfaceResidual")


def shot_file(stage: Usd.Stage) -> tuple[Path | None, str]:
    """Return the file of the shot that a stage shows, or why there is none to process.

    Of a result (`SHOT.usdface.usda`) that is the shot below it.
    """
    root = stage.GetRootLayer()
    setups = [prim for prim in stage.Traverse() if prim.GetTypeName() == _SETUP]
    if not setups:
        return None, (
            "this stage has no usdface setup: make a shot of your rig and take first, with "
            "`usdface shot --rig RIG --take TAKE -o shot.usda`, and open that"
        )
    if len(setups) > 1:
        names = ", ".join(str(prim.GetPath()) for prim in setups)
        return None, (f"this stage has {len(setups)} setups ({names}); open the shot of one face")
    if root.anonymous or not root.realPath:
        return None, "this stage is not saved; save it as a file first"
    path = Path(root.realPath)
    name = path.name.removesuffix(path.suffix)
    if name.endswith(".usdface"):
        below = [path.parent / each for each in root.subLayerPaths]
        shots = [each for each in below if each.parent == path.parent and each.exists()]
        if shots:
            return shots[-1], ""
    return path, ""


class Preview:
    """The layers of a result over a stage.

    Parameters
    ----------
    stage : Usd.Stage
    draw : callable
        Draws the viewport at once, between two edits.
    """

    def __init__(self, stage: Usd.Stage, draw: Callable[[], object]) -> None:
        self.stage = stage
        self._draw = draw
        self._layer = Sdf.Layer.CreateAnonymous("usdface")
        root = stage.GetRootLayer()
        # Without them USD would scale the time codes of the layers by the ratio to 24
        self._layer.timeCodesPerSecond = root.timeCodesPerSecond
        self._layer.framesPerSecond = root.framesPerSecond
        stage.GetSessionLayer().subLayerPaths.insert(0, self._layer.identifier)
        self._shown: tuple[str, ...] = ()
        self._painted: list[Sdf.Path] = []

    @property
    def frames(self) -> list[float]:
        """The time codes of the take's frames: those of the weakest layer's samples."""
        solve = Sdf.Layer.Find(self._shown[-1]) if self._shown else None
        return sorted(solve.ListAllTimeSamples()) if solve else []

    def show(self, layers: Sequence[str], muted: Sequence[str] = ()) -> None:
        """Show layers, the strongest first, without those of some names: ``"express"``, ...

        Layers that are shown already are read again.
        """
        wanted = tuple(layers)
        with self._faces_rebuilt():
            for each in wanted:
                there = Sdf.Layer.Find(each)
                if there:
                    there.Reload(True)
            gone = [each for each in self._shown if each not in wanted]
            self._mute([each for each in wanted if Path(each).stem in muted], (*wanted, *gone))
            if wanted != self._shown:
                self._layer.subLayerPaths = list(wanted)
            self._shown = wanted

    def mute(self, names: Sequence[str]) -> None:
        """Mute the layers of these names and no others."""
        with self._faces_rebuilt():
            self._mute([each for each in self._shown if Path(each).stem in names], self._shown)

    def _mute(self, muted: Sequence[str], ours: Sequence[str]) -> None:
        self.stage.MuteAndUnmuteLayers(list(muted), [each for each in ours if each not in muted])

    def paint(self, mesh: str, colours: np.ndarray) -> None:
        """Colour the vertices of a mesh: (V, 3), linear. Its materials are left out meanwhile."""
        target = self.stage.GetEditTargetForLocalLayer(self._layer)
        with self._faces_rebuilt(), Usd.EditContext(self.stage, target):
            prim = self.stage.OverridePrim(mesh)
            colour = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
                "displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.vertex
            )
            colour.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(colours, np.float32)))
            if not self._painted:
                UsdShade.MaterialBindingAPI.Apply(prim).Bind(self._material())
                subsets = [each for each in prim.GetChildren() if each.IsA(UsdGeom.Subset)]
                for subset in subsets:
                    UsdShade.MaterialBindingAPI(subset).GetDirectBindingRel().SetTargets([])
                self._painted = [each.GetPath() for each in (prim, *subsets)]

    def unpaint(self) -> None:
        """Show the mesh in its own colours and materials again."""
        if not self._painted:
            return
        with self._faces_rebuilt(), Sdf.ChangeBlock():
            for path in self._painted:
                spec = self._layer.GetPrimAtPath(path)
                spec.ClearInfo("apiSchemas")
                for name in [each.name for each in spec.properties]:
                    del spec.properties[name]
            del self._layer.rootPrims[_MATERIAL.name]
        self._painted = []

    def remove(self) -> None:
        """Take everything out again; the stage is as it was."""
        self.unpaint()
        self.show(())
        paths = self.stage.GetSessionLayer().subLayerPaths
        if self._layer.identifier in paths:
            paths.remove(self._layer.identifier)

    @contextmanager
    def _faces_rebuilt(self) -> Iterator[None]:
        """Let edits of faces be seen: Storm keeps a face's weights until its SkelRoot is rebuilt.

        After the edits the SkelRoots are inactive while the viewport is drawn.
        """
        yield
        roots = [prim.GetPath() for prim in self.stage.Traverse() if prim.IsA(UsdSkel.Root)]
        with Sdf.ChangeBlock():
            for path in roots:
                Sdf.CreatePrimInLayer(self._layer, path).SetInfo("active", False)
        # The first may end early: Storm names faces that are gone, once, as an error
        self._draw()
        self._draw()
        with Sdf.ChangeBlock():
            for path in roots:
                self._layer.GetPrimAtPath(path).ClearInfo("active")
        self._draw()

    def _material(self) -> UsdShade.Material:
        """Return a material that shows the colours of the vertices."""
        material = UsdShade.Material.Define(self.stage, _MATERIAL)
        reader = UsdShade.Shader.Define(self.stage, _MATERIAL.AppendChild("reader"))
        reader.CreateIdAttr("UsdPrimvarReader_float3")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
        result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
        surface = UsdShade.Shader.Define(self.stage, _MATERIAL.AppendChild("surface"))
        surface.CreateIdAttr("UsdPreviewSurface")
        surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(result)
        surface.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.7)
        output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(output)
        return material
