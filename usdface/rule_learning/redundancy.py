"""Redundant rules: another rule of the emotion fires everywhere at least as strongly.

AND is the minimum, so additional conditions lower the firing strength. Of the terms of one feature
and direction, the farther one has nowhere a larger membership: `far_raised` at most that of
`raised`, and `NOT raised` at most that of `NOT far_raised`.
"""

from usdface.rule_learning.terms import LinguisticTerms
from usdface.rule_learning.training_set import Conditions

__all__ = ["subsumes"]


def subsumes(general: Conditions, special: Conditions, terms: LinguisticTerms) -> bool:
    """Return whether `special` fires nowhere more strongly than `general`.

    Parameters
    ----------
    general, special : tuple of (term, negated)
        Terms are columns of `terms`.
    terms : LinguisticTerms
    """
    return all(any(_implies(s, g, terms) for s in special) for g in general)


def _implies(special: tuple[int, bool], general: tuple[int, bool], terms: LinguisticTerms) -> bool:
    (one, negated), (other, denied) = special, general
    if negated != denied or terms.feature[one] != terms.feature[other]:
        return False
    reach, wanted = terms.top[one], terms.top[other]
    if reach * wanted < 0:
        return False
    return bool(abs(reach) <= abs(wanted) if negated else abs(reach) >= abs(wanted))
