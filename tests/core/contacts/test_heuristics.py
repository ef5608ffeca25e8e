"""Heuristics: the formulas of section 5.2, and the ranking by their weighted sum."""

from __future__ import annotations

import importlib.util
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.contacts.heuristics import (
    BUILTIN,
    HEURISTICS,
    Candidates,
    check_names,
    rank,
)
from rbprm_core.errors import InvalidInput
from rbprm_core.guide.root import RootBounds
from rbprm_core.placement import Placement
from rbprm_core.planner import plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scene import Scene

Array = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1)


def candidates(seed: int = 0, count: int = 30, **changes: Any) -> Candidates:
    """Some candidates of a limb of four joints."""
    rng = np.random.default_rng(seed)
    jacobians = rng.normal(size=(count, 3, 3))
    grams = jacobians @ np.swapaxes(jacobians, 1, 2)
    normals = rng.normal(size=(count, 3)) + 3 * np.eye(3)[2]
    share = rng.uniform(0, 1, count)
    direction = rng.normal(size=3)
    low = rng.uniform(-2, -0.5, 4)
    high = low + rng.uniform(0.5, 3, 4)
    known: dict[str, Any] = {
        "joints": rng.uniform(low, high, (count, 4)),
        "reference": rng.uniform(low, high),
        "low": low,
        "high": high,
        "rng": np.random.default_rng(seed),
        "grams": grams,
        "manipulability": np.sqrt(np.linalg.det(grams)),
        "normals": normals / np.linalg.norm(normals, axis=1)[:, None],
        "friction": rng.uniform(0.1, 1, count),
        "centers": rng.normal(size=(count, 3)),
        "nominal": rng.normal(size=3),
        "direction": direction / np.linalg.norm(direction),
        "persistence": lambda: share,
    }
    known.update(changes)
    return Candidates(**{field.name: known[field.name] for field in fields(Candidates)})


@given(seeds)
def test_effort_is_equation_15(seed: int) -> None:
    some = candidates(seed)
    found = BUILTIN["effort"](some)
    m = -some.direction
    for gram, normal, friction, value in zip(
        some.grams, some.normals, some.friction, found, strict=True
    ):
        wanted = (m @ gram @ m) ** -0.5 * friction * (normal @ m)
        assert value == pytest.approx(wanted, rel=1e-6)


@given(seeds)
def test_velocity_is_equation_16(seed: int) -> None:
    some = candidates(seed)
    found = BUILTIN["velocity"](some)
    m = -some.direction
    for gram, normal, friction, value in zip(
        some.grams, some.normals, some.friction, found, strict=True
    ):
        wanted = (m @ np.linalg.inv(gram) @ m) ** -0.5 * friction * (normal @ m)
        assert value == pytest.approx(wanted, rel=1e-4, abs=1e-6)


def test_velocity_and_effort_of_a_limb_that_cannot_move_along_m() -> None:
    """A planar arm pushes well across its plane, where it cannot move at all."""
    flat = np.diag([1.0, 1.0, 0.0])
    some = candidates(
        count=2,
        grams=np.array([flat, np.eye(3)]),
        manipulability=np.array([0.0, 1.0]),
        normals=np.tile([0.0, 0.0, -1.0], (2, 1)),
        friction=np.ones(2),
        direction=np.array([0.0, 0.0, 1.0]),
    )
    assert BUILTIN["velocity"](some) == pytest.approx([0.0, 1.0])
    assert list(rank(some, {"velocity": 1.0})) == [1, 0]
    assert list(rank(some, {"effort": 1.0})) == [0, 1]


@given(seeds)
def test_reference_is_nearness_in_joint_space(seed: int) -> None:
    some = candidates(seed)
    best = rank(some, {"reference": 1.0})
    distances = [np.sqrt(((joints - some.reference) ** 2).sum()) for joints in some.joints]
    assert (np.diff(np.array(distances)[best]) >= -1e-12).all()
    assert BUILTIN["reference"](some) == pytest.approx(-np.array(distances))


@given(seeds)
def test_joint_limits_is_the_share_left_of_half_the_range(seed: int) -> None:
    some = candidates(seed)
    middle, half = (some.low + some.high) / 2, (some.high - some.low) / 2
    wanted = [min(1 - abs(joints - middle) / half) for joints in some.joints]
    assert BUILTIN["joint_limits"](some) == pytest.approx(wanted)
    at_limit = candidates(count=2, joints=np.array([middle, [some.low[0], *middle[1:]]]))
    edges = {"low": some.low, "high": some.high}
    at_limit = candidates(count=2, joints=at_limit.joints, **edges)
    assert BUILTIN["joint_limits"](at_limit) == pytest.approx([1.0, 0.0])


def test_random_depends_on_the_generator_alone() -> None:
    one, other = candidates(rng=np.random.default_rng(3)), candidates(rng=np.random.default_rng(3))
    first = BUILTIN["random"](one)
    assert (first == BUILTIN["random"](other)).all()
    assert (first != BUILTIN["random"](other)).any()  # the next draw is another
    assert (first != BUILTIN["random"](candidates(rng=np.random.default_rng(4)))).any()
    assert ((first >= 0) & (first < 1)).all()


def test_effort_is_greatest_where_the_surface_faces_against_the_motion() -> None:
    some = candidates(
        count=3,
        grams=np.tile(np.eye(3), (3, 1, 1)),
        friction=np.ones(3),
        normals=np.array([[1.0, 0, 0], [0, 0, 1], [-1, 0, 0]]),
        direction=np.array([1.0, 0, 0]),
    )
    assert list(rank(some, {"effort": 1.0})) == [2, 1, 0]


def test_effort_of_a_root_at_rest_says_nothing() -> None:
    assert BUILTIN["effort"](candidates(direction=np.zeros(3))) == pytest.approx(np.zeros(30))


@given(seeds)
def test_manipulability_is_equation_17(seed: int) -> None:
    some = candidates(seed)
    wanted = [np.sqrt(np.linalg.det(gram)) for gram in some.grams]
    assert BUILTIN["manipulability"](some) == pytest.approx(wanted)
    best = rank(some, {"manipulability": 1.0})
    assert (np.diff(some.manipulability[best]) <= 0).all()


def test_persistence_is_asked_only_where_it_counts() -> None:
    asked: list[int] = []

    def tell() -> Array:
        asked.append(1)
        return np.arange(30.0)

    some = candidates(persistence=tell)
    rank(some, {"manipulability": 1.0})
    assert asked == []
    assert list(rank(some, {"persistence": 1.0})) == list(range(29, -1, -1))


@given(seeds, st.floats(0, 5), st.floats(0, 5))
def test_the_rank_is_by_the_weighted_sum_of_shares(seed: int, one: float, other: float) -> None:
    some = candidates(seed)
    order = rank(some, {"manipulability": one, "persistence": other})
    assert sorted(order) == list(range(30))
    parts = [some.manipulability, some.persistence()]
    shares = [part / np.abs(part).max() for part in parts]
    total = one * shares[0] + other * shares[1]
    assert (np.diff(total[order]) <= 1e-12).all()


def test_ties_keep_their_order() -> None:
    some = candidates(manipulability=np.ones(30))
    assert list(rank(some, {"manipulability": 1.0})) == list(range(30))
    assert list(rank(some, {})) == list(range(30))


@pytest.mark.parametrize("name", sorted(BUILTIN))
def test_no_candidates_no_order(name: str) -> None:
    nobody: Callable[[], Array] = lambda: np.zeros(0)  # noqa: E731
    none = candidates(count=0, persistence=nobody)
    assert len(rank(none, {name: 1.0})) == 0


@pytest.mark.parametrize("name", sorted(BUILTIN))
def test_every_heuristic_gives_one_number_a_candidate(name: str) -> None:
    values = BUILTIN[name](candidates())
    assert values.shape == (30,)
    assert np.isfinite(values).all()


def test_an_unknown_name_lists_the_known_ones() -> None:
    check_names(dict.fromkeys(BUILTIN, 1.0), "limbs.a.heuristics")
    with pytest.raises(InvalidInput, match="effort, velocity, manipulability") as caught:
        check_names({"manipulability": 1.0, "intuition": 2.0}, "limbs.a.heuristics")
    assert (caught.value.field, caught.value.value) == ("limbs.a.heuristics", "intuition")


PLUGIN = """
import numpy as np

def lowest(candidates):
    return -candidates.centers[:, 2]

def too_many(candidates):
    return np.zeros(len(candidates) + 1)

def no_number(candidates):
    values = np.zeros(len(candidates))
    values[2:] = np.nan
    return values

def words(candidates):
    return ["best"] * len(candidates)

def failing(candidates):
    return 1 / 0

not_callable = 3
"""

ENTRY_POINTS = """[rbprm.heuristics]
{prefix}lowest = {module}:lowest
{prefix}too_many = {module}:too_many
{prefix}no_number = {module}:no_number
{prefix}words = {module}:words
{prefix}failing = {module}:failing
{prefix}not_callable = {module}:not_callable
{prefix}absent = {module}:absent
{prefix}no_module = {module}_2:lowest
"""


def install(folder: Path, module: str, prefix: str, version: str = "1.2") -> None:
    """What pip leaves behind: a module, and the metadata of its distribution."""
    (folder / f"{module}.py").write_text(PLUGIN)
    info = folder / f"{module}-{version}.dist-info"
    info.mkdir()
    text = f"Metadata-Version: 2.1\nName: {module}\nVersion: {version}\n"
    (info / "METADATA").write_text(text)
    (info / "entry_points.txt").write_text(ENTRY_POINTS.format(module=module, prefix=prefix))


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The version of an installed package that brings plug-ins."""
    install(tmp_path, "heuristics_of_mine", "mine_")
    monkeypatch.syspath_prepend(str(tmp_path))
    HEURISTICS.clear()
    yield "1.2"
    HEURISTICS.clear()


def test_a_plugin_ranks_like_one_of_ours(plugin: str) -> None:
    some = candidates()
    check_names({"mine_lowest": 1.0}, "limbs.a.heuristics")
    order = rank(some, {"mine_lowest": 1.0})
    assert (np.diff(some.centers[order, 2]) >= 0).all()
    order = rank(some, {"mine_lowest": 1.0, "manipulability": 0.5})
    heights = -some.centers[:, 2] / np.abs(some.centers[:, 2]).max()
    total = heights + 0.5 * some.manipulability / some.manipulability.max()
    assert (np.diff(total[order]) <= 1e-12).all()
    names = ["effort", "mine_lowest"]
    assert HEURISTICS.versions(names) == {"heuristics_of_mine": plugin}


def test_an_unknown_name_lists_plugins_too(plugin: str) -> None:
    with pytest.raises(InvalidInput, match=r"joint_limits.*mine_lowest"):
        check_names({"luck": 1.0}, "limbs.a.heuristics")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("not_callable", "must be callable, is int"),
        ("absent", "cannot be loaded: AttributeError"),
        ("no_module", "cannot be loaded: ModuleNotFoundError"),
    ],
)
def test_a_plugin_that_cannot_be_loaded_is_named(plugin: str, name: str, reason: str) -> None:
    with pytest.raises(InvalidInput, match=reason) as caught:
        check_names({f"mine_{name}": 1.0}, "limbs.a.heuristics")
    assert caught.value.field == f"heuristics.mine_{name}"
    assert "heuristics_of_mine 1.2" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("too_many", r"shape \(30,\), not \(31,\)"),
        ("no_number", "must return finite numbers, not nan for candidate 2"),
        ("words", "must return an array of numbers, not list"),
        ("failing", "failed: ZeroDivisionError: division by zero"),
    ],
)
def test_a_plugin_that_gives_no_number_a_candidate_is_named(
    plugin: str, name: str, reason: str
) -> None:
    check_names({f"mine_{name}": 1.0}, "limbs.a.heuristics")
    with pytest.raises(InvalidInput, match=reason) as caught:
        rank(candidates(), {f"mine_{name}": 1.0})
    assert caught.value.field == f"heuristics.mine_{name}"
    assert "heuristics_of_mine 1.2" in str(caught.value)


def test_two_plugins_of_one_name(
    plugin: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other"
    other.mkdir()
    install(other, "heuristics_of_yours", "mine_")
    monkeypatch.syspath_prepend(str(other))
    HEURISTICS.clear()
    with pytest.raises(InvalidInput, match="two plug-ins have this name") as caught:
        check_names({"mine_lowest": 1.0}, "limbs.a.heuristics")
    assert "heuristics_of_mine" in caught.value.value
    assert "heuristics_of_yours" in caught.value.value


def test_a_plugin_plans(plugin: str, toy_data: RobotData, flat_scene: Scene) -> None:
    """From the robot's description to the versions in the plan."""
    limbs = [limb.name for limb in toy_data.robot.limbs]
    weights = {name: {"mine_lowest": 1.0, "random": 0.1} for name in limbs}
    robot = Robot.load(toy_data.robot.description.with_heuristics(weights))
    data = load_robot_data(robot)  # ranking is no part of the data: they are in the cache
    bounds = RootBounds(np.array([-1, -1, 0.2]), np.array([1, 1, 0.6]), np.full(3, 0.2))
    ends = [Placement.parse([x, 0.0, 0.42]) for x in (0.0, 0.3)]
    request = PlanRequest(ends[0], ends[1], bounds, tuple(limbs), tuple(limbs), 2.0, seed=5)
    first, again = (plan(request, data, flat_scene, Budget(20.0)) for _ in range(2))
    assert first.statistics.versions["heuristics_of_mine"] == plugin
    assert len(first.states) == len(again.states)
    for one, other in zip(first.states, again.states, strict=True):
        assert (one.q == other.q).all()


def test_the_example_is_a_plugin() -> None:
    folder = Path(__file__).parents[3] / "examples" / "heuristic_plugin"
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    module, name = project["entry-points"][HEURISTICS.group]["wide_stance"].split(":")
    spec = importlib.util.spec_from_file_location(module, folder / f"{module}.py")
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    centers = np.array([[0.5, 0.1, 0.0], [0.0, 0.3, 0.0]])
    some = candidates(count=2, centers=centers, direction=np.array([1.0, 0.0, 0.0]))
    assert getattr(loaded, name)(some) == pytest.approx([0.1, 0.3])
    page = folder.parents[1] / "docs" / "heuristics.md"
    for line in (folder / f"{module}.py").read_text().splitlines()[-4:-1]:
        assert line in page.read_text(), "the worked example is another"


def test_ranking_is_no_part_of_the_robots_data(toy_data: RobotData) -> None:
    robot = Robot.load(toy_data.robot.description.with_heuristics({"lf": {"effort": 1.0}}))

    def computed(fraction: float) -> None:
        assert fraction == 1.0, "the data are computed anew"

    data = load_robot_data(robot, computed)
    assert data.robot.limbs[0].heuristics == {"effort": 1.0}
    assert data.robot.limbs[1].heuristics == toy_data.robot.limbs[1].heuristics
    assert (data.databases[0].joints == toy_data.databases[0].joints).all()
    with pytest.raises(InvalidInput, match="tail"):
        toy_data.robot.description.with_heuristics({"tail": {"effort": 1.0}})
