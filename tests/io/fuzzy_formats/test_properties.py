"""Any system comes back from every format, as it was and answering the same to the last bit."""

import numpy as np
import pytest
from expression_systems import changed, expression_system
from fuzzy_worlds import systems
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from usdface.errors import OutputError
from usdface.expression_system import ExpressionSystem
from usdface.fuzzy.inference import evaluate
from usdface.fuzzy.rule_parser import parse_rule
from usdface.fuzzy.variables import Term, Variable
from usdface.io.fuzzy_formats.files import read_fuzzy_file, write_fuzzy_file

ANY = settings(
    max_examples=20,
    phases=(Phase.generate,),  # systems are readable as they are; shrinking takes minutes
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def spoken(system: ExpressionSystem) -> ExpressionSystem:
    """The system with its rules' numbers as people write them, which say the same."""
    rules = []
    for rule in system.fuzzy.rules:
        words = rule.text.split()
        texts = [f"{v:g}" if w == repr(v) and float(f"{v:g}") == v else w for w, v in spelt(words)]
        rules.append(parse_rule(" ".join(texts), rule.weight, rule.enabled))
    return changed(system, rules=tuple(rules))


def spelt(words):
    for word in words:
        try:
            yield word, float(word)
        except ValueError:
            yield word, None


def comes_back(tmp_path, system, suffix):
    path = tmp_path / f"a{suffix}"
    path.unlink(missing_ok=True)
    try:
        write_fuzzy_file(path, system)
    except OutputError:
        assert not path.exists()
        assume(False)
    found, findings = read_fuzzy_file(path)
    assert findings == []
    expected = system if suffix == ".usdc" else spoken(system)
    assert found == expected
    data = path.read_bytes()
    write_fuzzy_file(path, found)
    assert path.read_bytes() == data
    x = np.random.default_rng(0).normal(0, 1e3, (50, len(system.features)))
    x[::7] = np.nan
    x[1::5] *= 1000
    with np.errstate(all="ignore"):
        one, other = evaluate(system.fuzzy, x), evaluate(found.fuzzy, x)
    np.testing.assert_array_equal(one.outputs, other.outputs)
    np.testing.assert_array_equal(one.firing, other.firing)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".fcl", ".fll", ".usdc"])
def test_any_system_comes_back(tmp_path, suffix):
    @ANY
    @given(systems())
    def check(system):
        comes_back(tmp_path, system, suffix)

    check()


@pytest.mark.slow
def test_any_system_of_matlabs_comes_back_from_fis(tmp_path):
    @ANY
    @given(systems(plain=True))
    def check(system):
        comes_back(tmp_path, system, ".fis")

    check()


@pytest.mark.slow
@ANY
@given(systems(), st.integers(0, 2**32 - 1))
def test_any_system_answers_frame_by_frame_as_all_at_once(system, seed):
    x = np.random.default_rng(seed).normal(0, 1e3, (40, len(system.features)))
    x[::9] = np.nan
    whole = evaluate(system.fuzzy, x)
    for i in range(0, 40, 7):
        alone = evaluate(system.fuzzy, x[i : i + 1])
        np.testing.assert_array_equal(alone.outputs[0], whole.outputs[i])
        np.testing.assert_array_equal(alone.firing[0], whole.firing[i])


@pytest.mark.slow
@ANY
@given(systems(), st.integers(0, 2**32 - 1))
def test_any_answer_lies_in_its_range_and_any_firing_in_its_weight(system, seed):
    x = np.random.default_rng(seed).normal(0, 1e3, (40, len(system.features)))
    answer = evaluate(system.fuzzy, x)
    low, high = np.array([v.span for v in system.fuzzy.outputs]).T
    slack = 1e-9 * (1 + np.abs(low) + np.abs(high))
    assert (answer.outputs >= low - slack).all() and (answer.outputs <= high + slack).all()
    weights = np.array([r.weight * r.enabled for r in system.fuzzy.rules])
    assert (answer.firing >= 0).all() and (answer.firing <= weights).all()


def test_all_digits_of_a_number_in_a_rule_travel(tmp_path):
    brow = Variable("brow_y", "input", terms=(Term("up", "ramp", (0.0, 1.0)),))
    rule = parse_rule("IF brow_y IS up THEN joy IS 0.12345678901234")
    system = expression_system((brow, Variable("joy", "output")), (rule,))
    for one, other in ((".fll", ".usda"), (".fis", ".usda"), (".fcl", ".usdc")):
        write_fuzzy_file(tmp_path / f"a{one}", system)
        write_fuzzy_file(tmp_path / f"b{other}", read_fuzzy_file(tmp_path / f"a{one}")[0])
        found, _ = read_fuzzy_file(tmp_path / f"b{other}")
        assert found.fuzzy.rules[0].consequents == rule.consequents
