from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "smoke_ground_reconstruction",
            "smoke_ground_reconstruction.reference",
        ],
        package_dir={"": "python"},
    )
)
