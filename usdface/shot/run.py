"""A run of the main job: options, hooks, progress and cached stages, whatever the shot."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar

from usdface.findings import Finding
from usdface.hooks import Hook
from usdface.options import ProcessOptions
from usdface.progress import Progress

__all__ = ["RetargetRun", "Stages", "Uncached"]

ValueT = TypeVar("ValueT")


class Stages(Protocol):
    """A source of the values of stages: computes them, or is a cache of them (`StageCache`)."""

    @property
    def used(self) -> Mapping[str, str] | None:
        """The origin of the value of each stage, "cached" or "computed"; None without a cache."""

    @property
    def not_kept(self) -> Sequence[Finding]:
        """Findings about values that the cache could not keep."""

    def stage(
        self,
        name: str,
        inputs: object,
        given: Mapping[str, object],
        compute: Callable[[], ValueT],
    ) -> ValueT:
        """Return the value that `compute` returns."""


class Uncached:
    """Stages that are computed in each run."""

    used: Mapping[str, str] | None = None
    not_kept: Sequence[Finding] = ()

    def stage(
        self,
        name: str,
        inputs: object,
        given: Mapping[str, object],
        compute: Callable[[], ValueT],
    ) -> ValueT:
        """Return the value that `compute` returns."""
        return compute()


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class RetargetRun:
    """A run of the main job, whatever its shot.

    Attributes
    ----------
    options : ProcessOptions
        Overrides of the shot's settings.
    hooks : sequence of Hook
        Functions between the steps.
    progress : Progress
    stages : Stages
        Returns the values of "solve" and of "express", kept or computed, and within the first that
        of "clean", which other characters may share.
    """

    options: ProcessOptions = ProcessOptions()
    hooks: Sequence[Hook] = ()
    progress: Progress = field(default_factory=Progress)
    stages: Stages = field(default_factory=Uncached)

    @property
    def uncached(self) -> "RetargetRun":
        """The same run with all stages computed."""
        return replace(self, stages=Uncached())
