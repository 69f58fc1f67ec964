import pytest
from pxr import Tf, Usd

from usdface.errors import InputError
from usdface.io.usd.errors import usd_errors, usd_message


def test_usd_says_it_without_its_cplusplus(tmp_path):
    with pytest.raises(Tf.ErrorException) as caught:
        Usd.Stage.Open(str(tmp_path / "none.usda"))
    assert usd_message(caught.value) == f"Failed to open layer @{tmp_path / 'none.usda'}@"


@pytest.mark.parametrize(
    "error", [ValueError("a\nb"), TypeError(), UnicodeError("x"), MemoryError(), RuntimeError("r")]
)
def test_what_goes_wrong_inside_names_the_file_in_one_line(error):
    with pytest.raises(InputError, match=r"face\.usda") as caught, usd_errors("face.usda"):
        raise error
    assert "\n" not in str(caught.value) and caught.value.__cause__ is error


def test_our_own_errors_keep_their_words_and_get_the_name_once():
    with pytest.raises(InputError, match=r"^face\.usda: no SkelRoot$"), usd_errors("face.usda"):
        raise InputError("no SkelRoot")
    with pytest.raises(InputError, match=r"^no such face\.usda$"), usd_errors("face.usda"):
        raise InputError("no such face.usda")
