"""What the launch files start, with which parameters; no ROS master is needed for that."""

import shutil
import subprocess

import pytest
import yaml

PACKAGE = "smoke_ground_reconstruction"
NS = "/ground_reconstruction"


def roslaunch(option, *arguments, file="ground_reconstruction.launch"):
    if shutil.which("roslaunch") is None:
        pytest.skip("roslaunch is not installed")
    command = ["roslaunch", *option, PACKAGE, file, *arguments]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    if "cannot launch" in answer.stderr or "is not a package" in answer.stderr:
        pytest.skip("the package is not in ROS_PACKAGE_PATH")
    assert answer.returncode == 0, answer.stderr
    return answer.stdout


def nodes(*arguments, **options):
    return set(roslaunch(["--nodes"], *arguments, **options).split())


def parameters(*arguments):
    return yaml.safe_load(roslaunch(["--dump-params"], *arguments))


def test_starts_a_manager_and_three_nodelets():
    stages = {f"{NS}/{stage}" for stage in ("denoiser", "segmenter", "reconstructor")}
    assert nodes() == stages | {f"{NS}/manager"}
    assert nodes("start_manager:=false", "manager:=/lidar_manager") == stages


@pytest.mark.parametrize("stage", ["denoiser", "reconstructor"])
def test_a_python_node_takes_the_place_and_the_topics_of_the_nodelet(stage):
    def arguments_of(engine):
        return roslaunch(["--args", f"{NS}/{stage}"], "cloud:=/points", f"{stage}:={engine}")

    assert nodes(f"{stage}:=python") == nodes()
    nodelet, node = arguments_of("cpp").split(), arguments_of("python").split()
    assert f"{PACKAGE}/{stage.capitalize()}" in nodelet
    assert any(word.endswith(f"{stage}_node") for word in node)
    remappings = [{word for word in words if ":=" in word} for words in (nodelet, node)]
    assert "~input:=/points" in remappings[0]
    assert remappings[0] == remappings[1]


def test_arguments_reach_the_nodes():
    given = parameters(
        "sensor_height:=0.45",
        "base_frame:=base_footprint",
        "base_height:=0.05",
        "sensor:=qt128",
        "queue_size:=10",
    )
    for stage in ("denoiser", "segmenter", "reconstructor"):
        assert given[f"{NS}/{stage}/queue_size"] == 10
    assert given[f"{NS}/reconstructor/sensor_height"] == 0.45
    for stage in ("segmenter", "reconstructor"):
        assert given[f"{NS}/{stage}/base_frame"] == "base_footprint"
        assert given[f"{NS}/{stage}/base_height"] == 0.05
        assert len(given[f"{NS}/{stage}/sensor_beams/rings"]) == 128
    assert given[f"{NS}/denoiser/alpha"] == 0.5


def test_parameters_of_a_file_hold_where_no_argument_is_given(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("denoiser: {alpha: 0.7}\nreconstructor: {sensor_height: 0.9}\n")
    given = parameters(f"params:={file}")
    assert given[f"{NS}/denoiser/alpha"] == 0.7
    assert given[f"{NS}/reconstructor/sensor_height"] == 0.9


def test_demo_plays_a_bag():
    wanted = nodes() | {"/play"}
    assert nodes("bag:=/room.bag", "rviz:=false", file="demo.launch") == wanted
    command = roslaunch(["--args", "/play"], "bag:=/room.bag", "rviz:=false", file="demo.launch")
    assert "--clock --rate 1.0 --loop /room.bag" in command
