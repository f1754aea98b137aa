"""Identity: join the detections of all frames to one track a person.

The ends of unambiguous tracklets are linked to the beginnings of later
ones, all at once (a path cover of least cost, by the Hungarian method): two who cross are kept
apart by where both were going, by their sizes and by their colours. What was seen of the two as
one is left out when it is short, and goes to whom it fits best when it is long.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from pydantic import Field

from robojackson.clips.people.person_detection import PersonDetection
from robojackson.clips.people.person_extent import stature
from robojackson.clips.people.tracklets import Tracklet, TrackletConfig, find_tracklets
from robojackson.config import config_dataclass

IMPOSSIBLE = 1e6
NEAR = 30
"""Frames at the end of a tracklet whose median size counts."""


@config_dataclass
class IdentityConfig:
    """Allowed changes from one detection of a person to the next.

    Attributes:
        tracklets: Limits of a tracklet.
        shortest_tracklet_s: A tracklet below this is no one, seconds.
        shortest_blend_s: Shortest tracklet that may be either of two people, seconds.
        memory_s: Length of the motion that leads across a gap, seconds.
        foresight_s: A motion is not continued for longer than this, seconds.
        reach: Distance that a person may be from where the motion leads, body heights.
        reach_speed: What is added to it for every second of a gap, body heights a second.
        farthest: Most that the two may be together, body heights.
        growth: Change of size, ratio.
        colour: Change of the mean colours, units of CIELAB.
        parting: Cost of ending one person and beginning another, unitless.
        shortest_s: Shortest time for which a person is visible, seconds.
        least_share: Least share of the clip in which a person is visible.
    """

    tracklets: TrackletConfig = Field(default_factory=TrackletConfig)
    shortest_tracklet_s: float = Field(default=0.1, ge=0)
    shortest_blend_s: float = Field(default=0.33, ge=0)
    memory_s: float = Field(default=0.7, gt=0)
    foresight_s: float = Field(default=0.5, ge=0)
    reach: float = Field(default=0.5, gt=0)
    reach_speed: float = Field(default=0.5, ge=0)
    farthest: float = Field(default=2.0, gt=0)
    growth: float = Field(default=1.6, gt=1)
    colour: float = Field(default=40.0, gt=0)
    parting: float = Field(default=2.5, gt=0)
    shortest_s: float = Field(default=0.3, ge=0)
    least_share: float = Field(default=0.1, ge=0, le=1)


def identify(
    frames: Sequence[Sequence[PersonDetection]],
    time_s: Float[np.ndarray, " T"],
    size: tuple[int, int],
    config: IdentityConfig,
) -> list[Float[np.ndarray, "T 33 7"]]:
    """Return one track a person, NaN where they are not visible, the largest steady one first.

    Args:
        frames: All detections of every frame.
        time_s: When each frame was taken, seconds.
        size: Width and height of the image, pixels.
    """
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    period_s = max(duration_s / max(len(time_s) - 1, 1), 1e-9)
    tracklets = find_tracklets(frames, time_s, size, config.tracklets)
    clear = [
        p for p in tracklets if not p.blended and _lasts(p, config.shortest_tracklet_s, period_s)
    ]
    blends = [p for p in tracklets if p.blended and _lasts(p, config.shortest_blend_s, period_s)]
    if not clear:  # beside a ghost of the first frame: where no other was seen, it is one person
        clear, blends = blends, []
    tracks = [_table(c, len(frames)) for c in assign_merged(blends, chains(clear, config), config)]
    shortest_s = max(config.shortest_s, config.least_share * duration_s)
    seen = [track for track in tracks if (~np.isnan(track[:, 0, 0])).sum() * period_s >= shortest_s]
    return by_size(seen, size)


def by_size(
    tracks: Sequence[Float[np.ndarray, "T 33 7"]], size: tuple[int, int]
) -> list[Float[np.ndarray, "T 33 7"]]:
    """Return the largest steady person first: median stature in the image times the share of
    frames."""

    def weight(track: np.ndarray) -> float:
        seen = ~np.isnan(track[:, 0, 0])
        return float(np.median(stature(track[seen, :, :2] * size)) * seen.mean())

    return sorted(tracks, key=weight, reverse=True)


def _lasts(tracklet: Tracklet, shortest_s: float, period_s: float) -> bool:
    return len(tracklet.frames) * period_s >= max(shortest_s, 2.5 * period_s)


def chains(tracklets: list[Tracklet], config: IdentityConfig) -> list[list[Tracklet]]:
    """Return the tracklets in order, one list a person."""
    from scipy.optimize import linear_sum_assignment

    count = len(tracklets)
    if not count:
        return []
    cost = np.full((count, 2 * count), IMPOSSIBLE)
    cost[:, count:] = config.parting
    for i, before in enumerate(tracklets):
        for j, after in enumerate(tracklets):
            if after.frames[0] > before.frames[-1]:
                cost[i, j] = _link(before, after, config)
    chosen = {int(i): int(j) for i, j in zip(*linear_sum_assignment(cost), strict=True)}
    follower = {i: j for i, j in chosen.items() if j < count}
    firsts = [i for i in range(count) if i not in follower.values()]
    chains = []
    for first in firsts:
        chain = [first]
        while chain[-1] in follower:
            chain.append(follower[chain[-1]])
        chains.append([tracklets[i] for i in chain])
    return chains


def assign_merged(
    blends: list[Tracklet], chains: list[list[Tracklet]], config: IdentityConfig
) -> list[list[Tracklet]]:
    """Return each tracklet of two seen as one to the person whom it fits best and who has no other
    there."""
    merged = [list(chain) for chain in chains]
    for blend in sorted(blends, key=lambda tracklet: -len(tracklet.frames)):
        costs = [_fit(blend, chain, config) for chain in merged]
        if costs and min(costs) < IMPOSSIBLE:
            merged[int(np.argmin(costs))].append(blend)
    return merged


def _fit(tracklet: Tracklet, chain: list[Tracklet], config: IdentityConfig) -> float:
    """Return the cost of a tracklet in a gap of a chain: the mean of the links to both of its
    neighbours."""
    first, last = tracklet.frames[0], tracklet.frames[-1]
    if any(p.frames[0] <= last and p.frames[-1] >= first for p in chain):
        return IMPOSSIBLE
    before = [p for p in chain if p.frames[-1] < first]
    after = [p for p in chain if p.frames[0] > last]
    links = [_link(max(before, key=lambda p: p.frames[-1]), tracklet, config)] if before else []
    links += [_link(tracklet, min(after, key=lambda p: p.frames[0]), config)] if after else []
    return float(np.mean(links)) if links else IMPOSSIBLE


def _link(before: Tracklet, after: Tracklet, config: IdentityConfig) -> float:
    """Return the sum of the changes across a gap, each over its allowed change."""
    gap_s = after.time_s[0] - before.time_s[-1]
    tall = float(np.median(before.tall[-NEAR:])), float(np.median(after.tall[:NEAR]))
    reach = min(config.reach + config.reach_speed * gap_s, config.farthest) * max(tall)
    ahead = _led(before, gap_s, config, ends=True) - np.array(after.place[0])
    back = _led(after, gap_s, config, ends=False) - np.array(before.place[-1])
    moved = (np.linalg.norm(ahead) + np.linalg.norm(back)) / 2.0 / reach
    grown = abs(np.log(tall[0] / tall[1])) / np.log(config.growth)
    differ = np.abs(_mean(before.colours) - _mean(after.colours))
    colour = float(differ[~np.isnan(differ)].mean()) if not np.isnan(differ).all() else 0.0
    if moved > 1.0 or grown > 1.0 or colour > config.colour:
        return IMPOSSIBLE
    return float(moved + grown + colour / config.colour)


def _led(tracklet: Tracklet, gap_s: float, config: IdentityConfig, ends: bool) -> np.ndarray:
    """Return where a tracklet leads to after its end, or came from before its beginning, pixels."""
    time_s, place = np.array(tracklet.time_s), np.array(tracklet.place)
    edge = -1 if ends else 0
    close = np.abs(time_s - time_s[edge]) <= config.memory_s
    if close.sum() < 2:
        return np.asarray(place[edge])
    middle = time_s[close] - time_s[close].mean()
    speed = middle @ (place[close] - place[close].mean(0)) / (middle @ middle)
    ahead_s = min(gap_s, config.foresight_s) * (1.0 if ends else -1.0)
    return np.asarray(place[edge] + speed * ahead_s)


def _mean(colours: list[np.ndarray]) -> np.ndarray:
    """Return the mean of the visible values."""
    table = np.array(colours)
    known = ~np.isnan(table)
    total = np.where(known, table, 0.0).sum(0)
    return np.where(known.any(0), total / np.maximum(known.sum(0), 1), np.nan)


def _table(chain: list[Tracklet], frames: int) -> Float[np.ndarray, "T 33 7"]:
    table = np.full((frames, 33, 7), np.nan)
    for tracklet in chain:
        table[tracklet.frames] = tracklet.rows
    return table
