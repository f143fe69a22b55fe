"""Scene files made on the spot for the tests of the simulator."""

import yaml

BOX = {
    "bounded": True,
    "room": {"outline": [[0, 0], [6, 0], [6, 5], [0, 5]]},
    "poses": [{"name": "centre", "at": [2.9, 2.4], "height": 0.7}],
}


def write_scene(folder, name="room", **changes):
    """A scene file: BOX with changed keys; returns its path."""
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump({**BOX, **changes}))
    return path


def long_room(folder, reflectivity, length=40.0):
    """A narrow room whose end walls stand head-on, 20 m from the sensor in the middle."""
    return write_scene(
        folder,
        room={
            "outline": [[0, 0], [length, 0], [length, 4], [0, 4]],
            "wall_reflectivity": reflectivity,
            "ceiling": 4.0,
        },
        poses=[{"name": "middle", "at": [length / 2, 2.0], "height": 2.0}],
    )
