"""Print how fast the fuzzy engine is, beside pyfuzzylite on the same system and frames.

8 inputs x 3 terms x 24 rules x 6 outputs, zero-order Sugeno; CPU time, the two taking turns, so
that other work on the machine meets both; medians. A long take comes first: afterwards the process
has the memory that short ones would otherwise have to ask for. A short take is timed twice: once a
turn, when the other program has just had the caches, and ten times in a row, where it had only the
first. pyfuzzylite 7 has no vectorised run
and goes frame by frame. 8 has one, but its metadata ask for numpy below 2, so it needs a folder of
its own:

    pip install --no-deps --target fl8 pyfuzzylite==8.0.6
    PYTHONPATH=fl8 python benchmarks/fuzzy.py

Both answer the same. At the end: frames per second in two processes at once.
"""

import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from importlib import metadata
from pathlib import Path
from tempfile import TemporaryDirectory

import fuzzylite as fl
import numpy as np

from usdface.expression_system import ExpressionSystem, MarkerFeature
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.system import FuzzySystem
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import write_fuzzy_file

TERMS = (
    Term("low", "triangular", (-1, -0.5, 0.25)),
    Term("medium", "trapezoidal", (-0.5, 0, 0.25, 1)),
    Term("high", "ramp", (0, 1)),
)
# Frames, and how often in a row.
RUNS, TURNS = ((40_000, 1), (4_000, 1), (4_000, 10), (400_000, 1)), 11
ONE_BY_ONE = 500
AT_ONCE, WORKERS = 1_000_000, 2


def world():
    rng = np.random.default_rng(0)
    variables = [Variable(f"x{i}", "input", terms=TERMS) for i in range(8)]
    variables += [Variable(f"e{i}", "output") for i in range(6)]
    rules = []
    for i in range(24):
        asked = rng.choice(8, 3, replace=False)
        said = [f"x{c} IS {rng.choice(TERMS).name}" for c in asked]
        rules.append(parse_rule(f"IF {' AND '.join(said)} THEN e{i % 6} IS {i % 11 / 10}"))
    return FuzzySystem(tuple(variables), tuple(rules))


def theirs_at_once(engine, inputs):
    for variable, values in zip(engine.input_variables, inputs.T, strict=True):
        variable.value = values
    engine.process()
    return np.stack([v.value for v in engine.output_variables], axis=1)


def theirs_one_by_one(engine, inputs):
    answers = np.zeros((len(inputs), 6))
    for answer, frame in zip(answers, inputs, strict=True):
        for variable, value in zip(engine.input_variables, frame, strict=True):
            variable.value = float(value)
        engine.process()
        answer[:] = [variable.value for variable in engine.output_variables]
    return answers


def timed(times, run, *given):
    begin = time.process_time()
    for _ in range(times):
        answer = run(*given)
    return (time.process_time() - begin) / (times * len(answer)) * 1e6, answer


def worker(seed):
    inputs = np.random.default_rng(seed).uniform(-1.2, 1.2, (AT_ONCE, 8))
    system = world()
    evaluate(system, inputs[:4096])
    begin = time.process_time()
    evaluate(system, inputs)
    return AT_ONCE / (time.process_time() - begin)


def main():
    system = world()
    with TemporaryDirectory() as folder:
        read = tuple(MarkerFeature(v.name) for v in system.inputs)
        write_fuzzy_file(Path(folder) / "a.fll", ExpressionSystem(system, read))
        engine = fl.FllImporter().from_string((Path(folder) / "a.fll").read_text())
    version = metadata.version("pyfuzzylite") if not hasattr(fl, "__version__") else fl.__version__
    vectorised = int(version.split(".")[0]) >= 8
    theirs = theirs_at_once if vectorised else theirs_one_by_one
    print(f"CPU time of a frame [us], median of {TURNS}; pyfuzzylite {version}")
    for frames, times in RUNS:
        inputs = np.random.default_rng(1).uniform(-1.2, 1.2, (frames, 8))
        few = inputs if vectorised else inputs[:ONE_BY_ONE]
        pairs = []
        for _ in range(TURNS):
            mine, answer = timed(times, lambda given: evaluate(system, given).outputs, inputs)
            other, expected = timed(times, theirs, engine, few)
            pairs.append((mine, other))
        ours, others = map(statistics.median, zip(*pairs, strict=True))
        ratio = statistics.median(other / mine for mine, other in pairs)
        off = np.abs(answer[: len(few)] - expected).max()
        print(
            f"{frames:9,} frames, {times:2} in a row: usdface {ours:6.3f}, pyfuzzylite "
            f"{others:7.3f}, {ratio:6.1f} times as long; largest difference {off:.1e}"
        )
    with ProcessPoolExecutor(WORKERS) as pool:
        rates = list(pool.map(worker, range(WORKERS)))
    print(f"{WORKERS} processes: {sum(rates) / 1e6:.1f} million frames a second of CPU time")


if __name__ == "__main__":
    main()
