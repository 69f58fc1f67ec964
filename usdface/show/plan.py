"""The plan of a sequence: each shot, how it is made, and its output files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from usdface.errors import InputError
from usdface.io.layer_paths import LayerPaths, layer_paths

__all__ = [
    "FILES",
    "LAYERS",
    "Making",
    "ShotPlan",
    "check_shared_layers",
    "plan_of",
    "same_outputs",
]

# Arguments of `usdface shot`, by the attributes of `Making`: files that it reads, and layers that
# shots share.
FILES = ("rig", "take", "bind", "calibration", "expressions", "fuzzy")
LAYERS = ("performer_layer", "character_layer")


@dataclass(frozen=True, slots=True, kw_only=True)
class Making:
    """The arguments with which `usdface shot` makes a shot.

    Attributes
    ----------
    rig, take : Path
    bind, calibration, expressions, fuzzy : Path or None
    neutral : (int, int), "auto" or None
        Neutral frames of the take, in place of the binding's.
    correction : mapping
        Fields of `CorrectionOptions`.
    performer : str
        "" = not named.
    performer_layer, character_layer : Path or None
        Layers that shots share; written where they are missing.
    """

    rig: Path
    take: Path
    bind: Path | None = None
    calibration: Path | None = None
    expressions: Path | None = None
    fuzzy: Path | None = None
    neutral: Any = None
    correction: Mapping[str, Any] = field(default_factory=dict)
    performer: str = ""
    performer_layer: Path | None = None
    character_layer: Path | None = None

    @property
    def named(self) -> dict[str, Path]:
        """The files and layers that it names, by the attribute that does."""
        paths = {name: getattr(self, name) for name in (*FILES, *LAYERS)}
        return {name: path for name, path in paths.items() if path is not None}

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that it names."""
        return tuple(path for name, path in self.named.items() if name in FILES)

    @property
    def layers(self) -> tuple[Path, ...]:
        """The layers that it shares with other shots."""
        return tuple(path for name, path in self.named.items() if name in LAYERS)

    @property
    def options(self) -> dict[str, Any]:
        """All but `named`, as plain values."""
        return {"neutral": self.neutral, "correction": dict(self.correction)}


@dataclass(frozen=True, slots=True, kw_only=True)
class ShotPlan:
    """A shot of a sequence.

    Attributes
    ----------
    name : str
        Of the shot, in the table.
    file : Path
    making : Making or None
        None: the shot is there, and only processed.
    gltf, page : bool
        Also write the result as .glb, as a page of `usdface view`.
    deliver : mapping or None
        Also write a deliverable: fields of `DeliverOptions`.
    process : mapping
        Fields of `ProcessOptions`.
    skip_hooks : tuple of str
        Hooks of other packages that do not run, as of `installed_hooks`.
    """

    name: str
    file: Path
    making: Making | None = None
    gltf: bool = False
    page: bool = False
    deliver: Mapping[str, Any] | None = None
    process: Mapping[str, Any] = field(default_factory=dict)
    skip_hooks: tuple[str, ...] = ()

    @property
    def paths(self) -> LayerPaths:
        """The layers of its result."""
        return layer_paths(self.file)

    @property
    def gltf_path(self) -> Path:
        """The path of its glTF."""
        return self.paths.root.with_suffix(".glb")

    @property
    def page_path(self) -> Path:
        """The path of its page."""
        return self.paths.root.with_suffix(".html")

    @property
    def deliver_path(self) -> Path:
        """The path of its deliverable."""
        return self.file.with_name(f"{self.file.stem}.face.usdc")

    @property
    def outputs(self) -> tuple[Path, ...]:
        """Its output files beside the result."""
        others = [self.gltf_path] * self.gltf + [self.page_path] * self.page
        others += [self.deliver_path] * (self.deliver is not None)
        return (*([self.file] * (self.making is not None)), self.paths.root, *others)

    @property
    def options(self) -> dict[str, Any]:
        """The options of its result, as plain values."""
        deliver = None if self.deliver is None else dict(self.deliver)
        wanted = {"gltf": self.gltf, "page": self.page, "deliver": deliver}
        skipped = sorted(set(self.skip_hooks))  # their order changes no result
        return {**wanted, "process": dict(self.process), "skip_hooks": skipped}

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as plain values, which `plan_of` reads."""
        made = self.making
        return {
            "name": self.name,
            "file": str(self.file),
            **self.options,
            "making": made
            and {
                part.name: str(value) if isinstance(value, Path) else value
                for part in fields(made)
                if (value := getattr(made, part.name))
            },
        }


def plan_of(plain: Mapping[str, Any]) -> ShotPlan:
    """Return the plan that `ShotPlan.as_dict` gave."""
    making = plain["making"]
    if making is not None:
        known = (*FILES, *LAYERS)
        paths = {name: Path(value) for name, value in making.items() if name in known}
        making = Making(**{**making, **paths})
    values = {**plain, "file": Path(plain["file"]), "making": making}
    return ShotPlan(**{**values, "skip_hooks": tuple(plain["skip_hooks"])})


def check_shared_layers(plans: Sequence[ShotPlan], show: Path) -> None:
    """Refuse a layer that shots share although its contents differ between them.

    The first shot would write it, and the others be solved with the binding or calibration of that.

    Raises
    ------
    InputError
        If it is so; the message names the show file, the layer and the files.
    """
    for layer, content in (("character_layer", "bind"), ("performer_layer", "calibration")):
        files: dict[Path, dict[Path, str]] = {}
        for plan in plans:
            place, file = (getattr(plan.making, name, None) for name in (layer, content))
            if place is not None and file is not None:
                files.setdefault(place.resolve(), {}).setdefault(file.resolve(), plan.name)
        for place, held in files.items():
            if len(held) > 1:
                (first, one), (second, other), *_ = held.items()
                shown = [first.name, second.name]
                if first.name == second.name:
                    shown = [str(first), str(second)]
                raise InputError(
                    f"{show}: {place} holds the {content} of one shot for all that share it, "
                    f"but {one} has {shown[0]} and {other} {shown[1]}; give each a layer of its "
                    'own: layer = {NAME = "FILE", ...} by performer or character, or '
                    f"{layer} of the shot",
                    "SETTING_WRONG",
                )


def same_outputs(plans: Sequence[ShotPlan]) -> dict[int, tuple[Path, str]]:
    """Return shots that would write one file: by place, the file and the other shot's name."""
    owners: dict[Path, int] = {}
    clashing: dict[int, tuple[Path, str]] = {}
    for number, plan in enumerate(plans):
        for path in plan.outputs:
            owner = owners.setdefault(path.resolve(), number)
            if owner != number:
                clashing.setdefault(owner, (path, plan.name))
                clashing.setdefault(number, (path, plans[owner].name))
    return clashing
