"""The curves of the last result of each scene, for the panel to draw; not saved."""

import bpy
import numpy as np

_CURVES: dict[str, dict] = {}  # by scene
_WORST, _APART = 5, 0.25  # frames, seconds between two of them
_FIRES = 0.05  # the least that is listed
_SHOWN = 4  # rules


def keep(scene: bpy.types.Scene, played) -> None:
    """Keep what the panel draws of a result."""
    system = played.shot.system
    _CURVES[scene.name] = {
        "result": scene.usdface.result,
        "first": scene.usdface.first_frame,
        "rate": played.shot.take.rate,
        "emotions": {name: np.asarray(curve) for name, curve in played.emotions.items()},
        "firing": played.firing,
        "rules": [" ".join(rule.text.split()) for rule in system.fuzzy.rules] if system else [],
        "residual": 1000.0 * played.residual,
    }


def forget() -> None:
    """Drop all curves."""
    _CURVES.clear()


def is_kept(scene: bpy.types.Scene) -> bool:
    """Whether curves of this scene are here, and not those of a file that was open before."""
    return _CURVES.get(scene.name, {}).get("result") == scene.usdface.result


def rules_at(scene: bpy.types.Scene, frame: float) -> list[tuple[float, str]]:
    """Return the rules that fire at a frame of the scene, the strongest first."""
    held, index = _at(scene, frame)
    if held is None or index >= len(held["firing"]):
        return []
    fired = sorted(zip(held["firing"][index], held["rules"], strict=False), reverse=True)
    return [(float(strength), text) for strength, text in fired if strength >= _FIRES][:_SHOWN]


def emotions_at(scene: bpy.types.Scene, frame: float) -> dict[str, float]:
    """Return the emotions of a frame of the scene."""
    held, index = _at(scene, frame)
    if held is None:
        return {}
    curves = held["emotions"].items()
    return {name: float(curve[index]) for name, curve in curves if index < len(curve)}


def _at(scene: bpy.types.Scene, frame: float) -> tuple[dict | None, int]:
    held = _CURVES.get(scene.name)
    index = round(frame - held["first"]) if held else 0
    return (held, index) if held and index >= 0 else (None, 0)


def list_worst(scene: bpy.types.Scene) -> None:
    """List the frames whose markers are farthest from the face, some time apart."""
    settings = scene.usdface
    settings.worst.clear()
    held = _CURVES[scene.name]
    residual, apart = np.array(held["residual"], float), round(_APART * held["rate"])
    for _ in range(_WORST):
        if not np.isfinite(residual).any():
            return
        index = int(np.nanargmax(residual))
        worst = settings.worst.add()
        worst.frame, worst.residual = held["first"] + index, residual[index]
        residual[max(0, index - apart) : index + apart + 1] = np.nan
