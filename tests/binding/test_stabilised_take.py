import numpy as np
import pytest
from worlds import filmed, make_world

from usdface.binding.stabilised_take import stabilised_take, without_head
from usdface.errors import InputError
from usdface.geometry.rigid_fit import rigid_fit


def test_the_head_is_held_still_by_what_is_calm() -> None:
    world = make_world()
    unmoved = make_world(head_moves=False).take.positions
    still = stabilised_take(world.take.positions).positions
    pose, _ = rigid_fit(unmoved[0], still[:1])
    back = pose.to_head(still[:1])
    np.testing.assert_allclose(back[0], unmoved[0], atol=1e-9)
    # Later on off by what the calm half of the face moves itself.
    apart = np.linalg.norm(
        (still - still[0]) - (unmoved - unmoved[0]) @ pose.rotations[0].T, axis=2
    )
    assert apart.max() < 0.004


@pytest.mark.parametrize(("kind", "option"), [("neutral", "--neutral 0 30"), ("peak", "--peaks")])
def test_an_image_has_no_head_pose_and_the_option_to_use_is_named(kind: str, option: str) -> None:
    with pytest.raises(InputError, match=f"its {kind} frames .* {option}"):
        without_head(filmed(make_world().take), kind)
