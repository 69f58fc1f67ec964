"""Names that are not taken yet."""

from hypothesis import given
from hypothesis import strategies as st

from usdface.io.unique_name import unique_name

NAMES = st.sampled_from(["st", "st_1", "st_2", "st_1_1", "uv"])


@given(NAMES, st.sets(NAMES))
def test_names_stay_where_they_may_and_are_never_taken(name: str, taken: set[str]) -> None:
    unused = unique_name(name, taken)
    assert unused not in taken
    assert unused.startswith(name)
    assert (unused == name) is (name not in taken)


def test_a_list_of_equal_names_becomes_names_of_their_own() -> None:
    names: list[str] = []
    for _ in range(4):
        names.append(unique_name("st", names))
    assert names == ["st", "st_1", "st_2", "st_3"]
