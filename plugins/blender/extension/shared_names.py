"""One name for one blend shape, in what Blender exports.

Blender counts through the names of blend shapes of all meshes that share a skeleton (jawOpen,
jawOpen2, jawOpen3), so that each mesh could move alone. A face is one: weights go by name.
"""

from pxr import Usd, UsdSkel, Vt

from .messages import FaceError

_SAME = 1e-6  # of a weight


def share_names(stage: Usd.Stage) -> list[str]:
    """Give blend shapes of equal name one weight, where they move alike.

    Returns
    -------
    list of str
        Names of blend shapes that do not, which keep the names that Blender gave them.

    Raises
    ------
    FaceError
        If shape keys of a mesh have one name in USD: Blender exports one of them.
    """
    by_skeleton: dict[str, list[UsdSkel.BindingAPI]] = {}
    for prim in stage.Traverse():
        binding = UsdSkel.BindingAPI(prim)
        if binding.GetBlendShapesAttr().HasAuthoredValue():
            skeleton = binding.GetInheritedSkeleton()
            place = str(skeleton.GetPath()) if skeleton else ""
            by_skeleton.setdefault(place, []).append(binding)
    apart: list[str] = []
    for place, bindings in by_skeleton.items():
        largest_first = sorted(bindings, key=lambda b: -len(b.GetBlendShapesAttr().Get()))
        apart += _share(_animation(stage.GetPrimAtPath(place) if place else None), largest_first)
    return apart


def _animation(skeleton: Usd.Prim | None) -> UsdSkel.Animation | None:
    """Return the animation of a skeleton; without Animation, Blender exports none."""
    source = UsdSkel.BindingAPI(skeleton).GetAnimationSource() if skeleton else None
    return UsdSkel.Animation(source) if source else None


def _share(animation: UsdSkel.Animation | None, bindings: list[UsdSkel.BindingAPI]) -> list[str]:
    columns, codes = _columns(animation)
    still = (0.0,) * len(codes)
    own: dict[str, tuple[float, ...]] = {}  # column of each own name
    apart = []
    for binding in bindings:
        tokens = list(binding.GetBlendShapesAttr().Get())
        targets = binding.GetBlendShapeTargetsRel().GetTargets()
        if len(targets) < len(tokens):
            raise FaceError(
                f"shape keys of {binding.GetPrim().GetName()} have the same name in USD; "
                "rename them, or export with Allow Unicode"
            )
        for i, (token, target) in enumerate(zip(tokens, targets, strict=True)):
            column = columns.get(token, still)
            if _alike(own.setdefault(target.name, column), column):
                tokens[i] = target.name
            else:
                apart.append(token)
                own[token] = column
        binding.GetBlendShapesAttr().Set(Vt.TokenArray(tokens))
    if animation is not None and columns:
        animation.GetBlendShapesAttr().Set(Vt.TokenArray(list(own)))
        for i, code in enumerate(codes):
            values = Vt.FloatArray([column[i] for column in own.values()])
            animation.GetBlendShapeWeightsAttr().Set(values, code)
    return apart


def _columns(
    animation: UsdSkel.Animation | None,
) -> tuple[dict[str, tuple[float, ...]], list[Usd.TimeCode | float]]:
    """Return the weights of each name at the time codes."""
    if animation is None:
        return {}, []
    names = list(animation.GetBlendShapesAttr().Get() or ())
    attribute = animation.GetBlendShapeWeightsAttr()
    codes = attribute.GetTimeSamples() or [Usd.TimeCode.Default()]
    rows = [attribute.Get(code) or [0.0] * len(names) for code in codes]
    return {name: tuple(row[i] for row in rows) for i, name in enumerate(names)}, codes


def _alike(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    return all(abs(a - b) <= _SAME for a, b in zip(one, other, strict=True))
