"""Tracks against the truth: errors of centres, labels, hidden dots, doubts."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from usdface.footage.tracks import Tracks

__all__ = ["Score", "judge"]

# A dot is visible if this share of what faces the camera is seen, hidden if at most this.
VISIBLE, HIDDEN = 0.9, 0.1
FAR = 6.0  # px: a dot that is another one


@dataclass(frozen=True)
class Score:
    """Of the samples that are visible: found, right label, errors [px]; of the others: invented."""

    dots: int
    tracks: int
    visible: int
    found: float
    labels: float
    unnoticed: int
    swaps_unnoticed: int
    centroid_rms: float
    vertex_rms: float
    worst: float
    invented: float

    def __str__(self) -> str:
        return (
            f"{self.tracks} tracks of {self.dots} dots, {self.visible} visible samples: "
            f"{100 * self.found:.2f} % found, labels of them right {100 * self.labels:.3f} %, "
            f"wrong and not noticed {self.unnoticed}, of these another dot's place "
            f"{self.swaps_unnoticed}; centre {self.centroid_rms:.3f} px RMS "
            f"in each coordinate (projected vertex {self.vertex_rms:.3f}), largest "
            f"{self.worst:.2f}; hidden dots that were given a place {100 * self.invented:.2f} %"
        )


def judge(tracks: Tracks, truth) -> Score:
    """Compare tracks with the truth of `benchmarks.footage.film.Truth` (or its file).

    Each track is the dot that it is nearest to in most frames, each dot one track.
    """
    centroids, vertices, shares = truth["centroids"], truth["vertices"], truth["shares"]
    places = np.asarray(tracks.places)
    away = np.linalg.norm(places[:, :, None] - centroids[:, None], axis=3)
    near = (np.nan_to_num(away, nan=1e6) < FAR) & (shares > 0.05)[:, None]
    rows, columns = linear_sum_assignment(-near.sum(axis=0))
    matched = {c: r for r, c in zip(rows, columns, strict=True) if near[:, r, c].any()}
    have = np.array(sorted(matched))
    own = np.array([matched[c] for c in have.tolist()])
    mine, true, seen = places[:, own], centroids[:, have], shares[:, have] >= VISIBLE
    gone = shares[:, have] <= HIDDEN
    given = ~np.isnan(mine[..., 0])
    error = np.linalg.norm(mine - true, axis=2)
    skin = np.linalg.norm(mine - vertices[:, have], axis=2)
    right = given & (error < FAR)
    wrong = given & ~right & (seen | gone)
    doubted = np.zeros(given.shape, bool)
    place_of = {t: k for k, t in enumerate(own.tolist())}
    for doubt in tracks.doubts:
        if doubt.track in place_of:
            doubted[doubt.first : doubt.last + 1, place_of[doubt.track]] = True
    good = right & seen
    other = (np.nan_to_num(away[:, own], nan=1e6) < FAR) & (shares > HIDDEN)[:, None]
    other[:, np.arange(len(have)), have] = False
    all_seen = int((shares >= VISIBLE).sum())
    return Score(
        dots=shares.shape[1],
        tracks=places.shape[1],
        visible=all_seen,
        found=float((given & seen).sum() / all_seen),
        labels=float(good.sum() / max((given & seen).sum(), 1)),
        unnoticed=int((wrong & ~doubted).sum()),
        swaps_unnoticed=int((wrong & ~doubted & other.any(axis=2)).sum()),
        centroid_rms=float(np.sqrt((error[good] ** 2).mean() / 2)),
        vertex_rms=float(np.sqrt((skin[good] ** 2).mean() / 2)),
        worst=float(error[good].max()),
        invented=float((given & gone).sum() / max(gone.sum(), 1)),
    )
