"""What colcon and ament need beside pyproject.toml, which has the metadata."""

from setuptools import setup

NAME = "rbprm_core"

setup(
    # Not in pyproject.toml: colcon cannot read the object that setuptools makes of it there.
    python_requires=">=3.11",
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        # All that setuptools reads: colcon runs this file in a folder with links to these alone.
        (f"share/{NAME}", ["package.xml", "pyproject.toml", "README.md", "LICENSE"]),
    ],
)
