"""Tells catkin which Python packages to build; not to be run by hand."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=["rosoclingo", "rosoclingo.bags"],
        package_dir={"": "src"},
        package_data={"rosoclingo.bags": ["html/*"]},
    )
)
