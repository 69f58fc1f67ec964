"""The shots of a sequence written as a show file, for a farm."""

import json
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.show.plan import ShotPlan

__all__ = ["show_json"]


def show_json(plans: list[ShotPlan], root: Path) -> str:
    """Return the shots as a show file, JSON, each with all that it needs; names relative to `root`.

    Raises
    ------
    InputError
        If a file lies outside of `root`.
    """
    shots = []
    for plan in plans:
        entry: dict[str, Any] = {"name": plan.name, "file": _relative(plan.file, root)}
        if made := plan.making:
            entry |= {name: _relative(path, root) for name, path in made.named.items()}
            entry |= dict(made.correction)
            entry |= {"neutral": made.neutral} if made.neutral else {}
            entry |= {"performer": made.performer} if made.performer else {}
        wanted = {"gltf": plan.gltf, "page": plan.page}
        entry["process"] = {**plan.process, **{k: True for k, wants in wanted.items() if wants}}
        if plan.skip_hooks:
            entry["process"]["skip_hooks"] = list(plan.skip_hooks)
        if plan.deliver is not None:
            entry["process"]["deliver"] = dict(plan.deliver) or True
        shots.append(entry)
    performers: dict[str, Any] = {
        str(shot["performer"]): {} for shot in shots if "performer" in shot
    }
    document = {"performers": performers, "shots": shots}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def _relative(path: Path, root: Path) -> str:
    try:
        return path.resolve().relative_to(root.resolve()).as_posix()
    except ValueError as error:
        raise InputError(
            f"{path} is not in {root}, which holds the show; name a folder that holds both",
            "SETTING_WRONG",
        ) from error
