"""Parameters that nobody reads are found."""

from smoke_ground_reconstruction.nodes.strange_params import strange_params


def test_known_ones_are_not_strange():
    names = ["/s/first/alpha", "/s/first/queue_size", "/s/first/sensor_beams/rings", "/rosdistro"]
    assert strange_params(names, "/s/first", ["alpha"]) == []


def test_misspelt_ones_are():
    names = ["/s/first/group/b", "/s/first/group/a", "/s/first/alhpa", "/s/first_of_others/gamma"]
    assert strange_params(names, "/s/first", ["alpha"]) == ["alhpa", "group"]
