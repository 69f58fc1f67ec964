"""Sensitivity to halved and doubled constants: `python benchmarks/sensitivity.py PACKAGE`.

Each row of `TABLE` names a module-level constant and the function of a benchmark whose figures it
is judged by. Every run is a process of its own, in which the module is compiled with the constant
multiplied, so that defaults of arguments and what other modules import from it follow. See
docs/constants.md, which has the results.

`--only NAME` measures one constant, `--measure FILE:FUNCTION` judges by other figures; with them
`--module MODULE --name NAME` measures a constant that is not in the table. `--markdown` prints rows
for docs/constants.md.
"""

import argparse
import ast
import builtins
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType

from rich.console import Console
from rich.table import Table

FACTORS = (0.5, 2.0)
_SCALE = "_scale_constant"


@dataclass(frozen=True)
class Constant:
    """A module-level constant, and the figures that it is judged by.

    Attributes
    ----------
    module, name : str
    measure : str
        "file:function" of a benchmark; it returns numbers by name.
    """

    module: str
    name: str
    measure: str


def rows(module: str, names: str, measure: str) -> list[Constant]:
    """Return a row for each of the `names`, which spaces part."""
    return [Constant(module, name, measure) for name in names.split()]


PLACED, CHECKED, CLEANED = "binding:figures", "binding:anchor_figures", "cleanup:figures"
SOLVED, RESTED = "solve_figures:figures", "binding:neutral_figures"
CALIBRATED, EXPRESSED = "calibration:figures", "expressions:layer_figures"
DESIGNED, LEARNED = "expressions:design_figures", "fuzzy_variants:figures"
JUDGED = "facs:figures"
CLOSED = "closure_figures:figures"
FILMED, NAMED = "footage_figures:figures", "footage_figures:name_figures"
TABLE: dict[str, list[Constant]] = {
    "binding": [
        *rows("usdface.binding.candidates", "LARGEST_WEIGHT _EVEN_CELL _DISC", PLACED),
        *rows("usdface.binding.face_surface", "_MARGIN MOVING_SHARE _CELLS _DEPTH _FACING", PLACED),
        *rows("usdface.binding.observations", "_FEWEST_MOVING _CENTRAL", PLACED),
        *rows("usdface.binding.registration", "SHAPE_ERROR MOTION_ERROR USUAL_COST", PLACED),
        *rows("usdface.binding.registration", "_SPREAD_BIAS _INDEPENDENT_PEAKS", PLACED),
        *rows("usdface.binding.registration", "_DEGREES_OF_FREEDOM", PLACED),
        *rows("usdface.binding.alignment", "_BEND _BEND_WIDTH _SPREAD", PLACED),
        *rows("usdface.binding.alignment", "_UPRIGHT _ANCHOR_WEIGHT _NAMED _PAIRED", PLACED),
        *rows("usdface.binding.peak_motion", "_WEIGHT_PRIOR", PLACED),
        *rows("usdface.binding.pose_search", "_TILTS _FOLLOWED _FINAL _COARSE", PLACED),
        *rows("usdface.binding.pose_search", "_FIRST_PEAKS _SAME _FIRST_SHAPE_ERROR", PLACED),
        *rows("usdface.binding.pose_search", "_FIRST_MOTION_ERROR _START_STEPS _STEPS", PLACED),
        *rows("usdface.binding.pose_search", "_LAST_STEPS _START_ANNEALED _WITHOUT_MOTION", PLACED),
        *rows("usdface.binding.confidence", "_HOPELESS_COST _HOPELESS_POWER", PLACED),
        *rows("usdface.binding.confidence", "_INDEPENDENT", PLACED),
        *rows("usdface.binding.neutral_frames", "_MOST_PEAKS _LEAST_PEAK", PLACED),
        *rows("usdface.binding.stabilised_take", "_MODES _ROUNDS _FEWEST_CALM _MEDIAN", PLACED),
        *rows("usdface.binding.held_poses", "_SAME_POSE _LONGEST_HOLD _STILL", PLACED),
        *rows("usdface.binding.held_poses", "_USUAL _BEGINS _APART", PLACED),
        *rows("usdface.binding.explaining_neutral", "_PRIOR", PLACED),
        *rows("usdface.binding.placed_markers", "_OFF_FACE", PLACED),
        *rows("usdface.binding.anchor_check", "_BETTER _AWAY _POOR_COST", CHECKED),
    ],
    "footage": [
        *rows("usdface.footage.components", "EDGE _HALF _LARGE _PIECE", FILMED),
        *rows("usdface.footage.detect", "CUT_OUT _SMALLEST _RAGGED _SLIM", FILMED),
        *rows("usdface.footage.detect", "_FOOT _PLATEAU _ALONG _BESIDE", FILMED),
        *rows("usdface.footage.follow", "_GATE _INERTIA _SIZE _LOST", FILMED),
        *rows("usdface.footage.finished_tracks", "_STRAY _DOUBT", FILMED),
        *rows("usdface.footage.join_tracks", "_JOIN", FILMED),
        *rows("usdface.footage.face_names", "_CAMERA _BEND _BEND_WIDTH _OWN _GATE", NAMED),
    ],
    "rule_design": [
        *rows("usdface.rule_design.feature_selection", "_LEAST_SIGNAL", DESIGNED),
        *rows("usdface.rule_design.selection_cost", "_DEAD_ZONE _TOP", DESIGNED),
        *rows("usdface.rule_design.feature_selection", "_STRONG _EVEN _HALF_MOVES", DESIGNED),
        *rows(
            "usdface.rule_design.feature_errors",
            "_FACE_ERROR _DIRECTION_ERROR _MISPLACED",
            DESIGNED,
        ),
        *rows("usdface.rule_design.selection_cost", "_ERROR_COST _ENOUGH _MISSING_COST", DESIGNED),
        *rows("usdface.rule_design.selection_cost", "_WORST", DESIGNED),
        *rows("usdface.rule_design.feature_selection", "_MOST_PAIRS _LEAST_GAIN", DESIGNED),
        *rows("usdface.rule_design.trial_faces", "_POSE _LIKE _WITHOUT _WITH", DESIGNED),
        *rows("usdface.rule_design.trial_faces", "_OTHER_POSE _VARIED _ALONE", DESIGNED),
        *rows("usdface.rule_design.trial_faces", "_MIXED", DESIGNED),
        *rows("usdface.rule_design.movements", "_DRAWS", DESIGNED),
        *rows("usdface.rule_design.negative_conditions", "LEAST_FIRING _CLEAR", DESIGNED),
        *rows("usdface.rule_design.marker_roles", "_MIDLINE", DESIGNED),
    ],
    "rule_learning": [
        *rows("usdface.rule_learning.terms", "_DEAD_ZONE _LEAST_SIGNAL _TOP _QUANTILE", LEARNED),
        *rows("usdface.rule_learning.terms", "_LEAST_DEAD_ZONE _DISTINCT", LEARNED),
        *rows("usdface.rule_learning.training_set", "_NOISE_COST _ALIKE LEAST_SIGNAL", LEARNED),
        *rows("usdface.rule_learning.rules", "_CONDITIONS _MOST_RULES _PART_COST _BEAM", LEARNED),
        *rows("usdface.rule_learning.rules", "_MOVEMENTS _WORST_MOVEMENT _COVERED", LEARNED),
        *rows("usdface.rule_learning.rules", "_VARIANT_COVERED _WORTHWHILE", LEARNED),
        *rows("usdface.rule_learning.rules", "FALLBACK_WEIGHT", LEARNED),
        *rows("usdface.rule_learning.fallback_rules", "_MOST_RULES _PARTS _PARTIAL", LEARNED),
        *rows("usdface.rule_learning.fallback_rules", "_MOVED _MOVEMENTS _LEAST_MET", LEARNED),
        *rows("usdface.rule_learning.fallback_rules", "_CONDITION_COST _NOISE_COST", LEARNED),
        *rows("usdface.rule_learning.fallback_rules", "_TOGETHER _SHORTLIST", LEARNED),
    ],
    "closure": [
        *rows("usdface.cleanup.blink_motion", "LONGEST_BLINK", CLOSED),
        *rows("usdface.closure.lid_pulses", "_SMOOTHING _ABOVE_NOISE APART", CLOSED),
        *rows("usdface.closure.lid_pulses", "LEAST_HEIGHT", CLOSED),
        *rows("usdface.closure.closings", "_BETTER_SEEN _OWN _MEASURED _BEYOND", CLOSED),
        *rows("usdface.closure.closings", "_UNSURE _TOP", CLOSED),
        *rows("usdface.closure.blinks", "_DOUBTED _SURE _ALONE _SHARED _SLOW _WIDEST", CLOSED),
        *rows("usdface.closure.held_eyes", "_CLOSED _OPEN _HALF_OPEN _HELD", CLOSED),
        *rows("usdface.closure.held_eyes", "_STILL_CLOSED _CLOSED_ALONE _CONTRADICTED", CLOSED),
        *rows("usdface.closure.lid_depth", "_GONE _GONE_OF_BLINKS _AS_FAR _AWAY", CLOSED),
        *rows("usdface.closure.lid_depth", "_SHOWN _AS_DEEP _SWEPT _SWEPT_BY_CLOSER", CLOSED),
    ],
    "correction": [
        *rows("usdface.options", "RESPONSE BLEND_TIME FEATURE_SMOOTHING", EXPRESSED),
        *rows("usdface.options", "EVIDENCE CONTACT_TOLERANCE MARKER_NOISE", EXPRESSED),
        *rows("usdface.correction.events", "_RELEASE _HELD _PLAY _PEAK", EXPRESSED),
        *rows("usdface.correction.evidence", "_PARTICIPATION _AROUND _FACE_ERROR", EXPRESSED),
        *rows("usdface.correction.motion_gain", "LEAST_MOTION _MOST", EXPRESSED),
        *rows("usdface.correction.sided_markers", "_GAIN_WIDTH", EXPRESSED),
        *rows("usdface.correction.contact", "_ROUNDS _STEPS _HALVINGS", EXPRESSED),
        *rows("usdface.correction.apertures", "_SLOPE", EXPRESSED),
    ],
    "retarget": [
        *rows("usdface.retarget.solver.regularisation", "_ALIKE", SOLVED),
        *rows(
            "usdface.retarget.solver.covariance",
            "_EXPECTED _BELIEF _LEAST _STEPS _BINS _SHOWN",
            SOLVED,
        ),
        *rows(
            "usdface.retarget.solver.solve", "_NEGLIGIBLE _ROUGH _JOINED _LEARNED_LONGER", SOLVED
        ),
        *rows("usdface.retarget.solver.shared_system", "_PENALTY _STIFFEST", SOLVED),
        *rows("usdface.retarget.solver.shared_system", "_LEARNED_PENALTY _USUAL", SOLVED),
        *rows("usdface.retarget.pose_and_weights", "_ROUNDS", SOLVED),
        *rows("usdface.retarget.solve_round", "_SETTLED_SHARE", SOLVED),
        *rows("usdface.retarget.map_choice", "_AS_GOOD", SOLVED),
        *rows("usdface.retarget.confidence", "_MANY", SOLVED),
        *rows("usdface.retarget.neutral_cost", "_SPREAD _SPARSITY", RESTED),
        *rows("usdface.retarget.neutral_weights", "_WINDOW _ERROR", RESTED),
        *rows("usdface.retarget.neutral_weights", "_COST _RELIEF _NEEDED LARGEST", RESTED),
        *rows("usdface.retarget.calibration", "_KNOWN _UNLIKE", CALIBRATED),
        *rows("usdface.retarget.wide_bounds", "_HELD AT_REST", CALIBRATED),
        *rows("usdface.retarget.gain_posterior", "_REACH _LEAST _LEAST_SPREAD", CALIBRATED),
        *rows("usdface.options", "PERFORMER_GAIN_SPREAD LARGEST_OFFSET OFFSET_SPREAD", CALIBRATED),
        *rows("usdface.options", "EXTREME_REACHED", CALIBRATED),
    ],
    "cleanup": [
        *rows("usdface.cleanup.clean", "_FEWEST_MARKERS _FEWEST_FRAMES _ROUNDS", CLEANED),
        *rows("usdface.cleanup.clean", "_REFINED _LONG _SHORT", CLEANED),
        *rows("usdface.cleanup.stabilise", "ROUNDS", CLEANED),
        *rows("usdface.cleanup.gaps", "OWN _STEP", CLEANED),
        *rows("usdface.cleanup.low_rank_model", "_MODES FRAMES_PER_MODE _ROUNDS", CLEANED),
        *rows("usdface.cleanup.spikes", "_USUAL _SHARE _SPEED _WINDOW _OFF _FAR", CLEANED),
        *rows("usdface.cleanup.label_assignment", "_JUMP _LANDING _USUAL", CLEANED),
    ],
    "facs": [
        *rows("usdface.facs.judge", "_HALF _LEAST", JUDGED),
        *rows("usdface.facs.fits", "SEEN", JUDGED),
        *rows("usdface.facs.feature_points", "_PATCH", JUDGED),
    ],
}


def scaled(value: object, factor: float) -> object:
    """Return numbers multiplied; whole ones stay whole and at least 1, tuples are multiplied."""
    if isinstance(value, bool):
        raise TypeError("a switch cannot be halved")
    if isinstance(value, int):
        return max(1, round(value * factor)) if value > 0 else round(value * factor)
    if isinstance(value, float):
        return value * factor
    if isinstance(value, tuple):
        return tuple(scaled(part, factor) for part in value)
    raise TypeError(f"expected a number or a tuple of numbers; found {value!r}")


class _ScaledModule(SourceFileLoader):
    """Compiles a module from source, with one constant multiplied after it is assigned."""

    constant = ""

    def get_code(self, fullname: str) -> CodeType:
        tree = ast.parse(self.get_data(self.path), self.path)
        assigned = [at for at, node in enumerate(tree.body) if self.constant in _targets(node)]
        if not assigned:
            raise ImportError(f"{fullname} has no constant {self.constant}")
        multiply = ast.parse(f"{self.constant} = {_SCALE}({self.constant})").body
        tree.body[assigned[-1] + 1 : assigned[-1] + 1] = multiply
        return compile(ast.fix_missing_locations(tree), self.path, "exec")


class _Finder(MetaPathFinder):
    """Finds the one module whose constant is multiplied."""

    def __init__(self, module: str, name: str) -> None:
        self.module, self.name = module, name

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != self.module:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        assert spec is not None and spec.origin is not None
        loader = _ScaledModule(fullname, spec.origin)
        loader.constant = self.name
        spec.loader = loader
        return spec


def _targets(node: ast.stmt) -> Iterator[str]:
    targets = node.targets if isinstance(node, ast.Assign) else []
    if isinstance(node, ast.AnnAssign):
        targets = [node.target]
    for target in targets:
        parts = target.elts if isinstance(target, ast.Tuple) else [target]
        yield from (part.id for part in parts if isinstance(part, ast.Name))


def value_of(constant: Constant) -> str:
    """Return the value as the module has it, in short."""
    value = getattr(import_module(constant.module), constant.name)
    return ", ".join(f"{part:g}" for part in (value if isinstance(value, tuple) else (value,)))


def measured(constant: Constant, factor: float) -> dict[str, float]:
    """Return the figures with the constant multiplied by `factor`, in a process of its own."""
    with tempfile.TemporaryDirectory() as compiled:  # numba's, which knows nothing of the factor
        environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        if factor != 1.0:
            environment |= {"NUMBA_CACHE_DIR": compiled}
        run = subprocess.run(
            [sys.executable, __file__, "--run", *vars(constant).values(), str(factor)],
            env=environment,
            capture_output=True,
            text=True,
        )
    if run.returncode:
        return {"fails: " + (run.stderr.strip().splitlines() or ["?"])[-1]: float("nan")}
    figures: dict[str, float] = json.loads(run.stdout.splitlines()[-1])
    return figures


def run_once(module: str, name: str, measure: str, factor: float) -> None:
    """Print the figures as JSON, with the constant multiplied unless `factor` is 1."""
    if factor != 1.0:
        setattr(builtins, _SCALE, lambda value: scaled(value, factor))
        sys.meta_path.insert(0, _Finder(module, name))
    file, function = measure.split(":")
    print(json.dumps(getattr(import_module(file), function)()))


def text_of(figures: dict[str, float], usual: dict[str, float]) -> str:
    """Return the figures that differ from the usual ones."""
    if any(name.startswith("fails") for name in figures):
        return next(iter(figures))
    differ = [
        f"{name} {figures[name]:.3g}"
        for name in usual
        if abs(figures[name] - usual[name]) > 0.005 * max(abs(usual[name]), 1e-12)
    ]
    return ", ".join(differ) or "same"


def report(constants: list[Constant], markdown: bool) -> None:
    console, usual = Console(width=200), {}
    for measure in dict.fromkeys(one.measure for one in constants):
        usual[measure] = measured(Constant("", "", measure), 1.0)
        figures = ", ".join(f"{name} {value:.3g}" for name, value in usual[measure].items())
        console.print(f"{measure} as it is: {figures}", highlight=False)
    table = Table("constant", "value", "halved", "doubled")
    for one in constants:
        cells = [text_of(measured(one, factor), usual[one.measure]) for factor in FACTORS]
        module = one.module.removeprefix("usdface.")
        row = (f"{module}.{one.name}", value_of(one), *cells)
        table.add_row(*row)
        if markdown:  # as they come: a table takes a while
            print(f"| `{module}` | `{one.name}` | {value_of(one)} | | {' | '.join(cells)} |")
            sys.stdout.flush()
    if not markdown:
        console.print(table)


def main() -> None:
    if sys.argv[1:2] == ["--run"]:
        module, name, measure, factor = sys.argv[2:]
        return run_once(module, name, measure, float(factor))
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("package", nargs="?", choices=TABLE)
    parser.add_argument("--only", metavar="NAME", help="one constant of the package")
    parser.add_argument("--module", help="of a constant that is not in the table")
    parser.add_argument("--name", help="of that constant")
    parser.add_argument("--measure", metavar="FILE:FUNCTION", help="the figures it is judged by")
    parser.add_argument("--markdown", action="store_true", help="rows for docs/constants.md")
    parsed = parser.parse_args()
    if parsed.module:
        constants = [Constant(parsed.module, parsed.name, parsed.measure)]
    else:
        constants = TABLE[parsed.package or next(iter(TABLE))]
        constants = [one for one in constants if parsed.only in (None, one.name)]
        if parsed.measure:
            constants = [replace(one, measure=parsed.measure) for one in constants]
    report(constants, parsed.markdown)


if __name__ == "__main__":
    main()
