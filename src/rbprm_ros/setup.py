"""ament_python package of the planner's node."""

from glob import glob

from setuptools import find_packages, setup

NAME = "rbprm_ros"

setup(
    name=NAME,
    version="0.1.0",
    description="ROS 2 node of the multi-contact planner rbprm_core",
    license="BSD-3-Clause",
    maintainer="rbprm maintainers",
    maintainer_email="rbprm-maintainers@example.org",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", sorted(glob("config/*.yaml") + glob("config/*.rviz"))),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    entry_points={
        "console_scripts": [
            "planner_node = rbprm_ros.executables:planner_node",
            "publish_surfaces = rbprm_ros.executables:publish_surfaces",
            "record_bag = rbprm_ros.executables:record_bag",
            "play_bag = rbprm_ros.executables:play_bag",
            "check_health = rbprm_ros.executables:check_health",
            "executive = rbprm_ros.executables:executive",
        ]
    },
    zip_safe=False,
)
