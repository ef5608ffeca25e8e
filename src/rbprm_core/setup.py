"""One package for pip and for colcon (ament_python)."""

from setuptools import find_packages, setup

NAME = "rbprm_core"

setup(
    name=NAME,
    version="0.1.0",
    description="Reachability-based acyclic multi-contact planning for legged robots",
    license="BSD-3-Clause",
    maintainer="rbprm maintainers",
    maintainer_email="rbprm-maintainers@example.org",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: [
            "py.typed",
            "robot/descriptions/*.toml",
            "scenarios/*.toml",
            "view/*.html",
            "bench/*.toml",
        ]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=[
        "pin>=4.0,<5",  # kinematics, URDF and SRDF
        "coal>=3.0.2,<4",  # collision
        "example-robot-data>=5,<7",  # the robots
        "hpp-environments>=6,<10",  # the papers' environments
        "numpy>=2.0,<3",
        "scipy>=1.13,<2",  # convex hulls; the check's LP (HiGHS)
        "daqp>=0.11,<1",  # the statics LP and the posture QP: small, dense, active set
        "qpsolvers[daqp]>=4.4,<5",  # the posture QP by the name of a solver
        "trimesh>=4.4,<6",  # mesh files, coplanar facets
        "networkx>=3,<4",  # graph functions that trimesh needs for facets
        "shapely>=2.0.4,<3",  # validity of polygons, outlines of merged facets
        "mapbox_earcut>=1.0.1,<3",  # triangulation of polygons with holes
        "pydantic>=2.7,<3",  # files with named fields, checked
        "platformdirs>=4,<5",  # where the cache lives
        "click>=8.1,<9",  # command line
        "rich>=13,<16",  # progress bars and tables
        "k3d>=3.2,<4",  # the self-contained 3-D page
        "matplotlib>=3.8,<4",  # the picture, plots of campaigns
        "joblib>=1.5,<2",  # campaigns over processes and clusters
        "threadpoolctl>=3.5,<4",  # one thread a run, whatever process it is in
    ],
    extras_require={
        "dask": ["distributed>=2025.1"],  # campaigns over machines
        "osqp": ["qpsolvers[osqp]"],  # other solvers of the posture QP, by name
        "proxqp": ["qpsolvers[proxqp]"],
        "test": ["pytest"],
    },
    entry_points={"console_scripts": ["rbprm = rbprm_core.cli.main:main"]},
    zip_safe=False,
)
