"""Finds the package in the source tree and the compiled module in the build directory."""

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))

import smoke_ground_reconstruction  # noqa: E402

BUILD = Path(os.environ.get("SMOKE_GROUND_BUILD", ROOT / "build"))
CORE_DIRECTORIES = (
    BUILD / "devel/lib/python3/dist-packages/smoke_ground_reconstruction",  # with catkin
    BUILD / "python/smoke_ground_reconstruction",  # plain CMake
)
for directory in CORE_DIRECTORIES:
    if list(directory.glob("_core*.so")):
        smoke_ground_reconstruction.__path__.append(str(directory))


@pytest.fixture(scope="session")
def core():
    """The compiled module; without it the test fails where SMOKE_GROUND_REQUIRE_CORE is set."""
    try:
        from smoke_ground_reconstruction import _core
    except ImportError as error:
        if os.environ.get("SMOKE_GROUND_REQUIRE_CORE"):
            raise
        pytest.skip(f"the compiled module is not built ({error})")
    return _core


def _real_scans():
    folder = os.environ.get("SMOKE_GROUND_SCANS", ROOT / "../shared/data/scans")
    return sorted(Path(folder).glob("*/*.npz"))


def pytest_generate_tests(metafunc):
    """One test per recorded scan for `every_real_scan`, one per sensor for `real_scan`."""
    if "every_real_scan" in metafunc.fixturenames:
        _parametrize(metafunc, "every_real_scan", _real_scans())
    if "real_scan" in metafunc.fixturenames:
        first = {path.parent: path for path in reversed(_real_scans())}
        _parametrize(metafunc, "real_scan", sorted(first.values()))


def _parametrize(metafunc, fixture, scans):
    skip = pytest.param(None, marks=pytest.mark.skip(reason="no scans: set SMOKE_GROUND_SCANS"))
    names = [f"{path.parent.name}-{path.stem}" for path in scans] or ["none"]
    metafunc.parametrize(fixture, scans or [skip], ids=names)
