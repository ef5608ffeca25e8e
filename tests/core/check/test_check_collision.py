"""Depth of single links against closed forms: in solids, through sheets, nested."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from rbprm_core.check import CheckReport, Kind, check_plan
from rbprm_core.errors import InvalidInput
from rbprm_core.plan_record import ContactPlan

GROUND = "hpp_environments/meshes/multicontact/ground.stl"  # solid, top at z = 0, 0.5 m thick
SHAPES = {
    "sphere": ('<sphere radius="0.05"/>', 0.05),
    "box": ('<box size="0.1 0.2 0.3"/>', 0.15),
    "cylinder": ('<cylinder radius="0.03" length="0.4"/>', 0.2),
}
ROBOT = """<robot name="lump"><link name="base"/>
 <joint name="weld" type="fixed"><parent link="base"/><child link="lump"/></joint>
 <link name="lump">
  <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><geometry>{}</geometry></collision>
 </link></robot>"""
POLYGON = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]


def lump(
    tmp_path: Path, shape: str, position: tuple[float, float, float], environment: dict[str, Any]
) -> CheckReport:
    """Report of a plan with one link at a position, which has no contacts and so no balance."""
    urdf = tmp_path / "lump.urdf"
    urdf.write_text(ROBOT.format(shape))
    pose = {"position": position, "orientation": [0, 0, 0, 1]}
    state = {"root": pose, "joints": [], "com": position, "robustness": 0.0, "contacts": []}
    plan = {
        "robot": {"name": "lump", "urdf": str(urdf), "joint_names": []},
        "environment": environment,
        "request": {"start": pose, "goal": pose},
        "guide": [],
        "states": [state],
    }
    return check_plan(ContactPlan.model_validate(plan))


def mesh(tmp_path: Path, name: str, shape: trimesh.Trimesh) -> str:
    path = tmp_path / f"{name}.stl"
    shape.export(path)
    return str(path)


def mesh_shape(tmp_path: Path, shape: trimesh.Trimesh) -> str:
    return f'<mesh filename="{mesh(tmp_path, "link", shape)}"/>'


def collides(report: CheckReport) -> bool:
    return any(v.kind == Kind.COLLISION for v in report.violations)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("depth", [-0.001, 0.0015, 0.0025, 0.03])
def test_depth_in_the_floor(tmp_path: Path, name: str, depth: float) -> None:
    shape, bottom = SHAPES[name]
    report = lump(tmp_path, shape, (0.3, 0.2, bottom - depth), {"meshes": [{"file": GROUND}]})
    assert report.deepest_collision == pytest.approx(max(depth, 0), abs=1e-5)
    assert collides(report) == (depth > 0.002)
    assert not report.valid


@pytest.mark.parametrize("depth", [0.0015, 0.03])
def test_depth_of_a_mesh_in_the_floor(tmp_path: Path, depth: float) -> None:
    shape = mesh_shape(tmp_path, trimesh.creation.box((0.1, 0.2, 0.3)))
    report = lump(tmp_path, shape, (0.3, 0.2, 0.15 - depth), {"meshes": [{"file": GROUND}]})
    assert report.deepest_collision == pytest.approx(depth, abs=1e-5)


def test_depth_in_a_finely_triangulated_floor(tmp_path: Path) -> None:
    slab = trimesh.creation.box((0.6, 0.6, 0.2))
    slab.apply_translation([0, 0, -0.1])
    fine = mesh(tmp_path, "slab", slab.subdivide_to_size(0.02))
    shape = mesh_shape(tmp_path, trimesh.creation.box((0.1, 0.1, 0.1)))
    for depth in (0.0015, 0.005, 0.03):
        report = lump(tmp_path, shape, (0.01, 0, 0.05 - depth), {"meshes": [{"file": fine}]})
        assert report.deepest_collision == pytest.approx(depth, abs=1e-4)


def test_the_depth_of_a_nearly_enclosed_ball_is_the_shortest_way_out(tmp_path: Path) -> None:
    shape, radius = SHAPES["sphere"]
    report = lump(tmp_path, shape, (0.3, 0.2, 0.001 - radius), {"meshes": [{"file": GROUND}]})
    assert report.deepest_collision == pytest.approx(2 * radius - 0.001, abs=1e-5)


@pytest.mark.parametrize("as_mesh", [False, True])
def test_a_link_inside_a_solid_is_found(tmp_path: Path, as_mesh: bool) -> None:
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    shape = mesh_shape(tmp_path, cube) if as_mesh else '<box size="0.1 0.1 0.1"/>'
    environment = {"meshes": [{"file": GROUND}]}
    report = lump(tmp_path, shape, (0.3, 0.2, -0.2), environment)
    assert report.deepest_collision == pytest.approx(0.25, abs=1e-5)
    assert collides(report)
    assert not collides(lump(tmp_path, shape, (0.3, 0.2, 0.2), environment))
    assert not collides(lump(tmp_path, shape, (0.3, 0.2, -0.7), environment))


def test_a_solid_inside_a_link_is_found(tmp_path: Path) -> None:
    pebble = mesh(tmp_path, "pebble", trimesh.creation.icosphere(subdivisions=1, radius=0.02))
    shape = mesh_shape(tmp_path, trimesh.creation.box((0.3, 0.3, 0.3)))
    environment = {"meshes": [{"file": pebble}]}
    report = lump(tmp_path, shape, (0.05, 0, 0), environment)
    assert report.deepest_collision == pytest.approx(0.12, abs=1e-3)
    assert collides(report)
    assert not collides(lump(tmp_path, shape, (0.3, 0, 0), environment))


def test_a_ring_round_a_post_is_free(tmp_path: Path) -> None:
    post = mesh(tmp_path, "post", trimesh.creation.box((0.1, 0.1, 2)))
    shape = mesh_shape(tmp_path, trimesh.creation.annulus(r_min=0.1, r_max=0.15, height=0.1))
    assert lump(tmp_path, shape, (0, 0, 0), {"meshes": [{"file": post}]}).deepest_collision == 0
    assert collides(lump(tmp_path, shape, (0.04, 0, 0), {"meshes": [{"file": post}]}))


def test_a_wedge_is_as_deep_as_its_edge(tmp_path: Path) -> None:
    step = trimesh.creation.box((1, 1, 1))
    step.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 4, [0, 1, 0]))
    step.apply_translation([0, 0, -np.sqrt(0.5) + 0.005])  # ridge at z = 0.005
    environment = {"meshes": [{"file": mesh(tmp_path, "ridge", step)}]}
    report = lump(tmp_path, '<box size="0.3 0.3 0.1"/>', (0, 0, 0.05), environment)
    assert report.deepest_collision == pytest.approx(0.005, abs=1e-4)


@pytest.mark.parametrize("seed", range(25))
def test_depth_is_that_of_the_minkowski_difference(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    link = trimesh.convex.convex_hull(rng.normal(size=(30, 3)) * 0.1)
    triangle = rng.normal(size=(3, 3)) * 0.15
    differences = (link.vertices[:, None] - triangle[None]).reshape(-1, 3)
    to_faces = -ConvexHull(differences).equations[:, 3]  # negative where the origin is outside
    environment = {"surfaces": [{"id": "facet", "vertices": triangle.tolist()}]}
    report = lump(tmp_path, mesh_shape(tmp_path, link), (0, 0, 0), environment)
    assert report.deepest_collision == pytest.approx(max(to_faces.min(), 0), abs=2e-5)


def test_a_polygon_is_a_sheet(tmp_path: Path) -> None:
    shape, radius = SHAPES["sphere"]
    environment = {"surfaces": [{"id": "floor", "vertices": POLYGON}]}
    report = lump(tmp_path, shape, (0.3, 0.2, radius - 0.01), environment)
    assert report.deepest_collision == pytest.approx(0.01, abs=1e-5)
    assert not collides(lump(tmp_path, shape, (0.3, 0.2, -2 * radius), environment))


def test_a_rotated_mesh_is_placed(tmp_path: Path) -> None:
    turn = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]  # the floor's top now faces -y, at y = 1
    environment = {"meshes": [{"file": GROUND, "rotation": turn, "translation": [0, 1, 0]}]}
    shape, radius = SHAPES["sphere"]
    report = lump(tmp_path, shape, (0, 1 - radius + 0.004, 0), environment)
    assert report.deepest_collision == pytest.approx(0.004, abs=1e-5)


def test_mimic_and_unbounded_joints_are_refused(tmp_path: Path) -> None:
    joint = '<joint name="{}" type="{}"><parent link="a"/><child link="{}"/><axis xyz="0 0 1"/>{}'
    limits = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    mimic = joint.format("j", "revolute", "b", limits) + "</joint>"
    mimic += joint.format("k", "revolute", "c", limits + '<mimic joint="j"/>') + "</joint>"
    endless = joint.format("j", "continuous", "b", "") + "</joint>"
    pose = {"position": (0, 0, 1), "orientation": (0, 0, 0, 1)}
    for joints, names, field in (
        (mimic, "abc", "robot.urdf"),
        (endless, "ab", "robot.joint_names"),
    ):
        urdf = tmp_path / "robot.urdf"
        links = "".join(f'<link name="{name}"/>' for name in names)
        urdf.write_text(f'<robot name="r">{links}{joints}</robot>')
        plan = {
            "robot": {"name": "r", "urdf": str(urdf), "joint_names": ["j"]},
            "environment": {"meshes": [{"file": GROUND}]},
            "request": {"start": pose, "goal": pose},
            "guide": [],
            "states": [],
        }
        with pytest.raises(InvalidInput, match="j") as caught:
            check_plan(ContactPlan.model_validate(plan))
        assert caught.value.field == field
