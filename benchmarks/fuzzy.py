"""Print how fast the fuzzy engine is, beside pyfuzzylite on the same system and frames.

8 inputs x 3 terms x 24 rules x 6 outputs, zero-order Sugeno, CPU time. pyfuzzylite 7.1 has no
vectorised run: it processes frame by frame, so it gets fewer of them. Both answer the same.
"""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

import fuzzylite as fl
import numpy as np

from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rules import parse_rule
from usdface.fuzzy.system import FuzzySystem, Term, Variable
from usdface.io.fuzzy_formats.files import write_fuzzy_file

TERMS = (
    Term("low", "triangular", (-1, -0.5, 0.25)),
    Term("medium", "trapezoidal", (-0.5, 0, 0.25, 1)),
    Term("high", "ramp", (0, 1)),
)
OURS, THEIRS = (4_000, 100_000, 1_000_000), 500


def world():
    rng = np.random.default_rng(0)
    variables = [Variable(f"x{i}", "input", "m", terms=TERMS) for i in range(8)]
    variables += [Variable(f"e{i}", "output") for i in range(6)]
    rules = []
    for i in range(24):
        asked = rng.choice(8, 3, replace=False)
        said = [f"x{c} IS {rng.choice(TERMS).name}" for c in asked]
        rules.append(parse_rule(f"IF {' AND '.join(said)} THEN e{i % 6} IS {i % 11 / 10}"))
    plain = {"normalisation": "per_output", "neutral_rule": False, "face_unit": "none"}
    return FuzzySystem(tuple(variables), tuple(rules), **plain)


def main():
    system = world()
    rng = np.random.default_rng(1)
    inputs = rng.uniform(-1.2, 1.2, (max(OURS), 8))
    for frames in OURS:
        taken = []
        for _ in range(5):
            begin = time.process_time()
            evaluate(system, inputs[:frames])
            taken.append(time.process_time() - begin)
        print(f"usdface      {frames:9,} frames  {min(taken) / frames * 1e6:9.3f} us a frame")
    with TemporaryDirectory() as folder:
        write_fuzzy_file(Path(folder) / "a.fll", system)
        engine = fl.FllImporter().from_string((Path(folder) / "a.fll").read_text())
    answers = np.zeros((THEIRS, 6))
    begin = time.process_time()
    for answer, frame in zip(answers, inputs, strict=False):
        for variable, value in zip(engine.input_variables, frame, strict=True):
            variable.value = float(value)
        engine.process()
        answer[:] = [variable.value for variable in engine.output_variables]
    taken = time.process_time() - begin
    print(f"pyfuzzylite  {THEIRS:9,} frames  {taken / THEIRS * 1e6:9.3f} us a frame")
    difference = np.abs(answers - evaluate(system, inputs[:THEIRS]).outputs).max()
    print(f"largest difference of their answers {difference:.1e}")


if __name__ == "__main__":
    main()
