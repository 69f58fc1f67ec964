"""Names of blend shapes that are a whole emotion: of artists, VRM and VRoid."""

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["EMOTION_NAMES"]

# Names of blend shapes without their spelling, of artists, VRM 1.0 ("happy"), VRM 0.x ("sorrow",
# "fun") and VRoid ("Fcl_ALL_Joy"). Those beyond the six count only where a rig has them.
EMOTION_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "joy": ("joy", "joyful", "happy", "happiness", "fclalljoy"),
        "sadness": ("sadness", "sad", "sorrow", "fclallsorrow"),
        "anger": ("anger", "angry", "fclallangry"),
        "fear": ("fear", "fearful", "afraid", "scared"),
        "disgust": ("disgust", "disgusted"),
        "surprise": ("surprise", "surprised", "fclallsurprised"),
        "contempt": ("contempt", "contemptuous"),
        "relaxed": ("relaxed", "fun", "fclallfun"),
    }
)
