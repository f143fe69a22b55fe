"""Every command in the README runs as it stands there, and what it names exists."""

import os
import re
import shlex
import subprocess
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def commands(program):
    lines = [line.split("#")[0].strip() for block in blocks("sh") for line in block.splitlines()]
    return [shlex.split(line) for line in lines if line.startswith(program)]


def test_the_commands_of_the_command_line_run_one_after_the_other(tmp_path):
    assert len(commands("scripts/smoke_ground")) >= 8
    (tmp_path / "config").symlink_to(ROOT / "config")
    for command in commands("scripts/smoke_ground"):
        done = subprocess.run(
            [str(ROOT / command[0]), *command[1:]],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"{shlex.join(command)}: {done.stderr}"
    made = {path.name for path in tmp_path.iterdir() if path.is_file() and path.stat().st_size > 0}
    assert made == {
        "room.npz",
        "floor.npz",
        "best.bag",
        "thesis.bag",
        "floor.png",
        "room.bag",
        "floor.bag",
        "nodelets.bag",
        "params.yaml",
    }


def test_every_other_command_is_one_that_ci_runs():
    lines = [line.split("#")[0].split()[0] for block in blocks("sh") for line in block.splitlines()]
    assert set(lines) == {"scripts/demo", "scripts/test", "scripts/smoke_ground", "roslaunch"}
    ci = (ROOT / ".ci/run").read_text()
    for script in ("scripts/demo", "scripts/test"):
        assert os.access(ROOT / script, os.X_OK) and f'"$root/{script}"' in ci


@pytest.mark.parametrize("command", commands("roslaunch"))
def test_the_launch_commands_start_the_three_nodelets(command):
    done = subprocess.run(
        [command[0], "--nodes", *command[1:]], capture_output=True, text=True, check=False
    )
    nodes = {f"/ground_reconstruction/{n}" for n in ("denoiser", "segmenter", "reconstructor")}
    assert nodes <= set(done.stdout.split()), done.stderr


def test_the_included_launch_file_has_the_arguments():
    (block,) = blocks("xml")
    include = ElementTree.fromstring(block)
    path = include.get("file").replace("$(find smoke_ground_reconstruction)", str(ROOT))
    known = {arg.get("name") for arg in ElementTree.parse(path).getroot().findall("arg")}
    assert {arg.get("name") for arg in include} <= known


def test_the_pictures_are_there_and_small():
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", README)
    assert pictures
    for picture in pictures:
        assert 0 < (ROOT / picture).stat().st_size < 500_000
