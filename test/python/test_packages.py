"""scripts/packages.txt names what package.xml needs, once each, for both systems."""

import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PARTS = ("package", "build", "test", "stand-ins")


def table():
    """(part, rosdep key, Debian packages, Ubuntu packages, reason) of each row."""
    rows, part = [], None
    for line in (ROOT / "scripts/packages.txt").read_text().splitlines():
        if line.startswith("["):
            part = line[1 : line.index("]")]
        elif line.strip() and not line.startswith("#"):
            key, debian, ubuntu, reason = line.split(maxsplit=3)
            rows.append((part, key, debian.split(","), ubuntu.split(","), reason))
    return rows


def needed_keys():
    package = ElementTree.parse(ROOT / "package.xml").getroot()
    return {element.text for element in package if element.tag.endswith("depend")}


def test_the_table_has_the_keys_of_package_xml():
    keys = Counter(key for part, key, *_ in table() if part == "package")
    assert set(keys) == needed_keys()
    assert set(keys.values()) == {1}


def test_the_table_has_the_parts_that_setup_installs():
    assert tuple(dict.fromkeys(part for part, *_ in table())) == PARTS


@pytest.mark.parametrize("row", table(), ids=lambda row: f"{row[1]}/{row[2][0]}")
def test_each_row_is_complete(row):
    part, key, debian, ubuntu, _ = row
    assert (key == "-") == (part != "package")
    assert debian != ["-"] or ubuntu != ["-"]
    # On Ubuntu the packages of ROS have ROS's names, and come from its archive.
    ros_packages = [name for name in ubuntu if name.startswith("ros-")]
    assert all(name.startswith("ros-noetic-") for name in ros_packages)
