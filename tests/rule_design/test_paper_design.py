import numpy as np
import pytest

from usdface.correction.rule_check import check_rules
from usdface.errors import InputError
from usdface.expression_system import MarkerFeature
from usdface.fuzzy.inference import evaluate
from usdface.rule_design.marker_roles import marker_features
from usdface.rule_design.paper_design import fit_paper
from usdface.rule_design.paper_system import EMOTIONS, MEDIUM, RULES, paper_system, published_cases

MARKERS = ("brow", "lid", "corner", "lip", "chin")
VARIABLES = marker_features(MARKERS, "absolute")
NOISE = np.full(len(VARIABLES), 0.005)
# Along y, one row for each emotion.
POSES = {
    "joy": (0.0, 0.02, 0.10, 0.03, 0.0),
    "surprise": (0.10, 0.06, 0.0, 0.0, 0.20),
    "anger": (0.07, 0.0, 0.0, 0.06, 0.0),
    "awe": (0.10, 0.0, 0.05, 0.0, 0.0),
}


def references():
    features = np.zeros((len(POSES), len(VARIABLES)))
    features[:, 1::3] = list(POSES.values())
    return features


def inputs_of(system, features):
    column = {v.name: i for i, v in enumerate(VARIABLES)}
    return features[:, [column[v.name] for v in system.fuzzy.inputs]]


def test_the_papers_own_rules_with_the_papers_own_poses():
    """Its thirteen inputs and six emotions are known: terms are made anew, rules stay."""
    inputs = published_cases().inputs
    read = [MarkerFeature(*name.rsplit("_", 1), "absolute") for name in MEDIUM]
    noise = np.full(13, 0.01)
    system, _ = fit_paper(read, inputs, EMOTIONS, noise, "take")
    assert [rule.text for rule in system.fuzzy.rules] == list(RULES)
    printed = {v.name: {t.name: t.parameters for t in v.terms} for v in paper_system().fuzzy.inputs}
    for variable in system.fuzzy.inputs:
        terms = {t.name: t.parameters for t in variable.terms}
        assert terms["low"][1] == printed[variable.name]["low"][1]
        assert terms["high"][1] == printed[variable.name]["high"][1]
        assert terms["medium"][1] == np.median(inputs[:, list(MEDIUM).index(variable.name)])


def test_every_reference_is_heard_as_itself():
    system, _ = fit_paper(VARIABLES, references(), list(POSES), NOISE)
    outputs = evaluate(system.fuzzy, inputs_of(system, references())).outputs
    assert (outputs.argmax(axis=1) == np.arange(len(POSES))).all()
    assert outputs[np.arange(len(POSES)), np.arange(len(POSES))].min() > 0.5
    assert len(system.fuzzy.rules) == len(POSES)
    assert all(len(rule.propositions) <= 3 for rule in system.fuzzy.rules)


def test_peaks_are_the_least_the_middle_and_the_largest_reference():
    system, _ = fit_paper(VARIABLES, references(), list(POSES), NOISE)
    for variable in system.fuzzy.inputs:
        values = references()[:, [v.name for v in VARIABLES].index(variable.name)]
        peaks = [term.parameters[1] for term in variable.terms]
        assert peaks == [values.min(), np.median(values), values.max()]


def test_no_rule_asks_only_for_what_a_neutral_face_has():
    system, _ = fit_paper(VARIABLES, references(), list(POSES), NOISE)
    for rule in system.fuzzy.rules:
        assert {p.term for p in rule.propositions} != {"low"}
    assert "RULE_FIRES_AT_NEUTRAL" not in {f.code for f in check_rules(system)}


def test_an_emotion_may_have_several_references():
    poses = np.concatenate([references(), references()[2:3]])
    poses[-1, 1::3] = (0.0, 0.09, 0.0, 0.0, 0.0)
    system, _ = fit_paper(VARIABLES, poses, [*POSES, "anger"], NOISE)
    result = [rule.consequents[0][0] for rule in system.fuzzy.rules]
    assert sorted(result) == ["anger", "anger", "awe", "joy", "surprise"]
    outputs = evaluate(system.fuzzy, inputs_of(system, poses)).outputs
    assert outputs.argmax(axis=1).tolist() == [0, 1, 2, 3, 2]


def test_a_feature_that_differs_by_its_noise_only_is_not_used():
    noise = np.array(NOISE)
    noise[[v.name for v in VARIABLES].index("chin_y")] = 0.06
    system, _ = fit_paper(VARIABLES, references(), list(POSES), noise)
    assert "chin_y" not in {v.name for v in system.fuzzy.inputs}


def test_one_pose_or_none_that_moves_is_refused():
    with pytest.raises(InputError, match="compares reference poses"):
        fit_paper(VARIABLES, references()[:1], ["joy"], NOISE)
    with pytest.raises(InputError, match="no marker moves differently"):
        fit_paper(VARIABLES, 0 * references(), list(POSES), NOISE)


def test_the_settings_are_the_papers():
    system, _ = fit_paper(VARIABLES, references(), list(POSES), NOISE)
    assert system.mode == "add"
    assert (system.fuzzy.else_rule, system.fuzzy.normalisation) == (False, "all_rules")


def test_a_pose_without_motions_of_its_own_gets_no_rule():
    poses = np.concatenate([references(), 0.5 * references()[:1]])
    system, findings = fit_paper(VARIABLES, poses, [*POSES, "bliss"], NOISE)
    unseen = {f.where for f in findings if f.code == "EXPRESSION_UNSEEN"}
    assert unseen == set(system.emotions) - {r.consequents[0][0] for r in system.fuzzy.rules}
    silent, result = fit_paper(VARIABLES, np.repeat(poses[:2], 2, axis=0), "abcd", NOISE)
    assert silent.fuzzy.rules == ()
    assert [f.where for f in result] == list("abcd")
