"""How sure each point of the floor is: the probability that there is floor in its cell.

A logistic model of what the scan shows around a point. Its weights stand in config/confidence.yaml,
where `smoke_ground calibrate` writes them and both engines read them. Not in the thesis.
"""

from functools import lru_cache

import numpy as np

from ..config_files import config_directory
from .azimuth_bins import around_columns
from .floor_surface import BoundaryKind

_RIM = (0.02, 0.1, 0.5, 2.0)  # distances to the end of the floor at which its influence is nil [m]
_LIMIT_RIM = 0.3
_LONG_BRIDGE = 100.0  # columns
_NEAR_DROP = 25.0  # columns
_DROP_RIM = 0.1  # [m]
_FAR = 8.0  # [m]
_FARTHEST_BEYOND = 2.0  # beyond the farthest measured floor of the column [m]
_POST_HALF = 0.03  # posts tell where a wall is to about so much [m]
_POSTS_OFF = 0.2  # [m]
_SEEN_COLUMNS = 2  # to either side whose floor counts
_POST_COLUMNS = 2  # to either side whose posts count
_POST_RETURNS = 6

FEATURES = (
    "constant",  # 1
    "drawn",  # 1 for what was not measured
    "post",  # the boundary is a wall without a line
    "inferred",  # the boundary is a bridge
    "limit",  # the boundary is a limit of knowledge
    "rim_20",  # 1 at the end of the floor, 0 from 20 mm before it
    "rim_100",
    "rim_500",
    "rim_2000",
    "rim_100_inferred",
    "rim_500_inferred",
    "rim_300_limit",
    "bridge",  # columns of the bridge, of 100
    "bridge_rim_500",
    "no_post",  # a wall is seen, but no post beside the column
    "no_post_rim_100",
    "posts_off_wall",  # posts stand before the wall, of 0.2 m
    "posts_off_bridge",  # ... before the bridge
    "past_post_wall",  # 0 before the posts, 1 behind them
    "past_post_bridge",
    "past_post_rim_100",
    "beyond",  # of the farthest measured floor [m], drawn points
    "drop",  # the scan shows one
    "near_drop",  # 1 in its columns, 0 from 10 deg beside them
    "near_drop_drawn",
    "near_drop_beyond",
    "drop_rim_100",
    "unknown",  # share of columns without a wall seen
    "unknown_inferred",
    "far",  # planar range, of 8 m
    "far_rim_100",
)
"""What the model knows of a point, in the order of its weights."""


@lru_cache(maxsize=1)
def weights():
    """The model's weights (F,) float64 in the order of FEATURES.

    Raises
    ------
    ValueError
        config/confidence.yaml names other features.
    """
    path = config_directory() / "confidence.yaml"
    lines = path.read_text(encoding="utf-8").splitlines()
    pairs = [line.split(":") for line in lines if line and not line.startswith("#")]
    if tuple(name for name, _ in pairs) != FEATURES:
        raise ValueError(f"{path}: its features are not {', '.join(FEATURES)}")
    return np.array([float(value) for _, value in pairs])


def measured_confidence(room, claim):
    """Of the measured points, float32 in the order of ``np.flatnonzero(claim.measured)``.

    Parameters
    ----------
    room : Room
    claim : FloorClaim
    """
    return _logistic(measured_features(room, claim) @ weights())


def drawn_confidence(room, claim, drawn):
    """Of the drawn points, float32 (M,).

    Parameters
    ----------
    room : Room
    claim : FloorClaim
    drawn : DrawnFloor
    """
    return _logistic(drawn_features(room, claim, drawn) @ weights())


def measured_features(room, claim):
    """FEATURES (M, F) float64 of the measured points."""
    column, planar = room.column[claim.measured], room.planar[claim.measured]
    return _features(_Columns(room, claim), column, planar, 0.0)


def drawn_features(room, claim, drawn):
    """FEATURES (M, F) float64 of the drawn points."""
    return _features(_Columns(room, claim), drawn.column, drawn.planar, 1.0)


def _logistic(logit):
    return (1.0 / (1.0 + np.exp(-logit))).astype(np.float32)


class _Columns:
    """What each column shows; arrays (columns,)."""

    def __init__(self, room, claim):
        kind, distance = room.profile.kind, room.profile.distance
        self.inferred = (kind == BoundaryKind.WALL_INFERRED).astype(np.float64)
        self.limit = (kind == BoundaryKind.LIMIT_OF_KNOWLEDGE).astype(np.float64)
        self.wall = 1.0 - self.inferred - self.limit
        self.post = self.wall * (room.profile.line < 0)
        self.end = np.minimum(claim.limit, room.drops.begin)
        self.seen = around_columns(room.own_floor, _SEEN_COLUMNS, np.max)
        self.bridge = np.minimum(_run_lengths(self.inferred > 0.0), _LONG_BRIDGE) / _LONG_BRIDGE
        posts = _post_distance(room.posts, room.columns)
        self.has_post = np.isfinite(posts)
        self.posts = np.where(self.has_post, posts, 0.0)
        off = np.clip((distance - self.posts) / _POSTS_OFF, 0.0, 1.0)
        self.off = np.where(self.has_post, off, 0.0)
        drop = np.isfinite(room.drops.begin)
        self.drop = float(drop.any())
        self.near_drop = np.maximum(0.0, 1.0 - _columns_to(drop) / _NEAR_DROP)
        self.drop_begin = room.drops.begin
        self.unknown = 1.0 - np.count_nonzero(kind == BoundaryKind.WALL_SEEN) / room.columns


def _features(columns, column, planar, drawn):
    at = {name: np.broadcast_to(value, columns.end.shape)[column] for name, value in _own(columns)}
    rim = [_hinge(at["end"] - planar, reach) for reach in _RIM]
    past = np.clip((planar - at["posts"] + _POST_HALF) / (2.0 * _POST_HALF), 0.0, 1.0)
    past = np.where(at["has_post"], past, 0.0)
    no_post = at["wall"] * ~at["has_post"]
    beyond = np.minimum(np.maximum(0.0, planar - at["seen"]), _FARTHEST_BEYOND)
    far = np.minimum(planar, _FAR) / _FAR
    values = (
        np.ones(len(planar)),
        np.full(len(planar), drawn),
        at["post"],
        at["inferred"],
        at["limit"],
        *rim,
        at["inferred"] * rim[1],
        at["inferred"] * rim[2],
        at["limit"] * _hinge(at["end"] - planar, _LIMIT_RIM),
        at["bridge"],
        at["bridge"] * rim[2],
        no_post,
        no_post * rim[1],
        at["off"] * at["wall"],
        at["off"] * at["inferred"],
        past * at["wall"],
        past * at["inferred"],
        past * rim[1],
        beyond * drawn,
        at["drop"],
        at["near_drop"],
        at["near_drop"] * drawn,
        at["near_drop"] * beyond,
        _hinge(at["drop_begin"] - planar, _DROP_RIM),
        at["unknown"],
        at["unknown"] * at["inferred"],
        far,
        far * rim[1],
    )
    return np.column_stack(values)


def _own(columns):
    return vars(columns).items()


def _hinge(margin, reach):
    """1 at the end and past it, falling to 0 at `reach` [m] before it."""
    return np.maximum(0.0, 1.0 - np.maximum(0.0, margin) / reach)


def _run_lengths(mask):
    """Length of the run of true columns, round the circle, that each column lies in; else 0."""
    count = len(mask)
    if mask.all():
        return np.full(count, float(count))
    lengths = np.zeros(count)
    first = int(np.argmin(mask))
    order = (first + np.arange(count)) % count
    edges = np.flatnonzero(np.diff(np.r_[False, mask[order], False].astype(np.int8)))
    for begin, end in zip(edges[::2], edges[1::2]):
        lengths[order[begin:end]] = end - begin
    return lengths


def _columns_to(mask):
    """Columns from each to the nearest true one, round the circle; infinite where none is."""
    count, away = len(mask), np.full(len(mask), np.inf)
    for shift in range(int(_NEAR_DROP) + 1):
        for turned in (np.roll(mask, shift), np.roll(mask, -shift)):
            away[turned & (away > shift)] = min(shift, count)
    return away


def _post_distance(posts, columns):
    """Planar range of the outermost post of each column and those beside it, the lower median of
    the columns that have one [m]; NaN where none has."""
    own = np.full(columns, -np.inf)
    strong = posts.count >= _POST_RETURNS
    np.maximum.at(own, posts.column[strong], posts.distance[strong])
    own[own == -np.inf] = np.inf
    near = around_columns(own, _POST_COLUMNS, np.sort)
    count = np.isfinite(near).sum(axis=0)
    found = near[np.maximum(0, (count - 1) // 2), np.arange(columns)]
    return np.where(count > 0, found, np.nan)
