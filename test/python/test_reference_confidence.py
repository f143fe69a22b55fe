"""The confidence of room_boundary's floor where its order is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from smoke_ground_reconstruction.reference import confidence
from smoke_ground_reconstruction.reference.confidence import FEATURES

SEEN, INFERRED, LIMIT = 0, 1, 2
COLUMNS = 900


def room_of(kind=SEEN, drop_at=None, posts_at=None):
    """All columns alike: boundary at 4 m; `drop_at` (column, range), `posts_at` range of posts."""
    begin = np.full(COLUMNS, np.inf)
    if drop_at is not None:
        begin[drop_at[0]] = drop_at[1]
    count = 0 if posts_at is None else COLUMNS
    return SimpleNamespace(
        columns=COLUMNS,
        column=np.zeros(0, np.int64),
        planar=np.zeros(0),
        profile=SimpleNamespace(
            kind=np.full(COLUMNS, kind),
            line=np.zeros(COLUMNS, np.int64),
            distance=np.full(COLUMNS, 4.0),
        ),
        drops=SimpleNamespace(begin=begin),
        posts=SimpleNamespace(
            count=np.full(count, 10),
            column=np.arange(count),
            distance=np.full(count, posts_at or 0.0),
        ),
        own_floor=np.full(COLUMNS, 1.0),
    )


def features_at(planar, room, column=0):
    claim = SimpleNamespace(limit=np.full(COLUMNS, 4.0), measured=np.zeros(0, bool))
    drawn = SimpleNamespace(column=np.array([column]), planar=np.array([planar]))
    values = confidence.drawn_features(room, claim, drawn)[0]
    return dict(zip(FEATURES, values))


def test_the_rim_is_told_by_hinges():
    found = features_at(3.95, room_of())
    assert found["rim_20"] == 0.0
    assert found["rim_100"] == pytest.approx(0.5)
    assert found["rim_500"] == pytest.approx(0.9)
    assert found["beyond"] == 2.0  # 2.95 m, capped
    assert found["no_post"] == 1.0 and found["no_post_rim_100"] == pytest.approx(0.5)


def test_floor_measured_two_columns_beside_counts():
    room = room_of()
    room.own_floor[[3, 898]] = 3.0, 2.75
    beyond = [features_at(3.5, room, column)["beyond"] for column in (0, 1, 4, 6, 897, 895)]
    assert beyond == [0.75, 0.5, 0.5, 2.0, 0.75, 2.0]


def test_a_point_behind_the_posts_of_a_bridge():
    found = features_at(3.9, room_of(INFERRED, posts_at=3.8))
    assert found["past_post_bridge"] == 1.0 and found["past_post_wall"] == 0.0
    assert found["posts_off_bridge"] == 1.0  # 0.2 m before the boundary
    assert found["bridge"] == 1.0 and found["unknown_inferred"] == 1.0
    assert features_at(3.7, room_of(INFERRED, posts_at=3.8))["past_post_bridge"] == 0.0
    assert features_at(3.8, room_of(INFERRED, posts_at=3.8))["past_post_bridge"] == 0.5


def test_a_drop_counts_round_the_circle():
    room = room_of(drop_at=(895, 2.0))
    assert features_at(1.0, room, 895)["near_drop"] == 1.0
    assert features_at(1.0, room, 5)["near_drop"] == pytest.approx(1.0 - 10 / 25)
    assert features_at(1.0, room, 60)["near_drop"] == 0.0
    assert features_at(1.0, room, 60)["drop"] == 1.0
    assert features_at(1.95, room, 895)["drop_rim_100"] == pytest.approx(0.5)


def test_length_of_a_bridge_across_the_first_column():
    kind = np.zeros(COLUMNS, np.int64)
    kind[[898, 899, 0, 1, 2, 40]] = INFERRED
    lengths = confidence._run_lengths(kind == INFERRED)
    assert lengths[[898, 0, 2, 40, 3]].tolist() == [5, 5, 5, 1, 0]
    assert np.all(confidence._run_lengths(np.ones(4, bool)) == 4)


def test_the_middle_of_a_room_is_surer_than_its_rim():
    room = room_of(posts_at=4.0)
    claim = SimpleNamespace(limit=np.full(COLUMNS, 4.0), measured=np.zeros(0, bool))
    drawn = SimpleNamespace(column=np.zeros(2, np.int64), planar=np.array([2.5, 4.0]))
    inside, rim = confidence.drawn_confidence(room, claim, drawn)
    assert 0.5 < rim < inside < 1.0


def test_weights_of_other_features_are_refused(tmp_path, monkeypatch):
    (tmp_path / "confidence.yaml").write_text("# old\nconstant: 1.0\n")
    monkeypatch.setattr(confidence, "config_directory", lambda: tmp_path)
    confidence.weights.cache_clear()
    with pytest.raises(ValueError, match="confidence.yaml: its features are not constant, drawn"):
        confidence.weights()
    monkeypatch.undo()
    confidence.weights.cache_clear()
