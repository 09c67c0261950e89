"""Tells catkin which Python packages to build; not to be run by hand."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "rosoclingo_gazebo",
            "rosoclingo_gazebo.demo",
            "rosoclingo_gazebo.markers",
            "rosoclingo_gazebo.navigation",
            "rosoclingo_gazebo.simulator",
            "rosoclingo_gazebo.world",
        ],
        package_dir={"": "src"},
    )
)
