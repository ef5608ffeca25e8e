"""Guide planners of other packages: chosen by name, validated, and the documented example."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from rbprm_core.budget import Budget
from rbprm_core.errors import Cancelled, InvalidInput
from rbprm_core.guide.protocol import GuideProblem
from rbprm_core.guide.registry import GUIDE_PLANNERS, guide_planner
from rbprm_core.guide.root_space import RootBounds, RootSpace
from rbprm_core.placement import Placement
from rbprm_core.planner import plan
from rbprm_core.request import PlanRequest, StageNames
from rbprm_core.robot.data import RobotData
from rbprm_core.scene import Scene, Surface, make_surface

EXAMPLE = Path(__file__).parents[3] / "examples" / "guide_planner_plugin"
LEGS = ("lf_leg", "rf_leg", "lh_leg", "rh_leg")
GROUND = [[-2, -2, 0], [5, -2, 0], [5, 2, 0], [-2, 2, 0]]
BOUNDS = RootBounds(np.array([-1, -1.5, 0.4]), np.array([4, 1.5, 0.8]), np.full(3, 0.4))
START, GOAL = (np.array([x, 0, 0.62, 0, 0, 0, 1]) for x in (0.0, 2.4))

MODULE = """
import numpy as np
from rbprm_core.guide.protocol import GuideResult
from rbprm_core.guide.root import GuidePath
from rbprm_core.guide.root.root_planner import rrt_planner

class Wrong:
    def __init__(self, nodes):
        self.nodes = nodes

    def find(self, budget, rng, *, direct=True):
        budget.check("guide")
        return GuideResult(GuidePath(np.array(self.nodes)), 2)

def elsewhere(problem):
    return Wrong([problem.start, problem.start])

def no_start(problem):
    return Wrong([problem.goal, problem.goal])

def narrow(problem):
    return Wrong([problem.start[:3], problem.goal[:3]])

def not_finite(problem):
    return Wrong([problem.start, problem.start + np.nan, problem.goal])

def failing(problem):
    return 1 / 0

def right(problem):
    return rrt_planner(problem)
"""
NAMES = ("elsewhere", "no_start", "narrow", "not_finite", "failing", "right")

Install = Callable[..., None]
Make = Callable[..., GuideProblem]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Writes the metadata that pip writes, and makes a folder with modules importable."""

    def write(folder: Path, distribution: str, points: dict[str, str]) -> None:
        info = tmp_path / f"{distribution}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n"
        )
        lines = [f"{name} = {target}" for name, target in points.items()]
        (info / "entry_points.txt").write_text("\n".join([f"[{GUIDE_PLANNERS.group}]", *lines, ""]))
        for path in (folder, tmp_path):
            monkeypatch.syspath_prepend(str(path))
        GUIDE_PLANNERS.clear()

    yield write
    GUIDE_PLANNERS.clear()


@pytest.fixture
def mine(install: Install, tmp_path: Path) -> None:
    """Installs the package `guides_of_mine` with the planners of MODULE."""
    (tmp_path / "guides_of_mine.py").write_text(MODULE)
    points = {f"mine_{name}": f"guides_of_mine:{name}" for name in NAMES}
    install(tmp_path, "guides_of_mine", points)
    importlib.invalidate_caches()


@pytest.fixture
def problem(hyq_data: RobotData) -> Make:
    """Makes a problem: HyQ walks 2.4 m over flat ground."""
    space = RootSpace(BOUNDS, np.zeros(0), np.zeros(0))
    return lambda **fields: GuideProblem(
        **{
            "data": hyq_data, "scene": Scene([make_surface("ground", GROUND, 0.5)]),
            "start": START, "goal": GOAL, "space": space, "required_limbs": LEGS,
            "gravity": np.array([0, 0, -9.81]), **fields,
        }
    )  # fmt: skip


@pytest.mark.usefixtures("mine")
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("elsewhere", "does not contain the goal"),
        ("no_start", "does not contain the start"),
        ("narrow", r"has nodes of shape \(2, 3\), must be \(n, 7\)"),
        ("not_finite", "has length nan"),
    ],
)
def test_a_guide_that_is_wrong_names_its_package(problem: Make, name: str, reason: str) -> None:
    planner = guide_planner(f"mine_{name}", problem())
    with pytest.raises(InvalidInput, match=reason) as caught:
        planner.find(Budget(), np.random.default_rng(0))
    assert caught.value.field == f"guide_planners.mine_{name}"
    assert "guides_of_mine 1.2" in caught.value.value


@pytest.mark.usefixtures("mine")
def test_an_exception_names_its_package(problem: Make) -> None:
    with pytest.raises(InvalidInput, match="failed: ZeroDivisionError") as caught:
        guide_planner("mine_failing", problem())
    assert "guides_of_mine 1.2" in caught.value.value
    with pytest.raises(InvalidInput, match="failed: AttributeError"):
        guide_planner("mine_elsewhere", problem()).failure(START)


@pytest.mark.usefixtures("mine")
def test_a_planner_of_another_package_works_like_one_of_this(problem: Make) -> None:
    planners = [guide_planner(name, problem()) for name in ("rrt", "mine_right")]
    guides = [planner.find(Budget(), np.random.default_rng(2)).guide for planner in planners]
    assert np.array_equal(guides[0].nodes, guides[1].nodes)
    stopped = guides[0].root(1.0)
    for planner in planners:
        assert planner.failure(stopped) is None
        assert planner.trunk_failure(stopped) is None
        planner.avoid(stopped, keep=(START, GOAL))
        planner.forget()


@pytest.mark.usefixtures("mine")
def test_errors_of_the_budget_pass(problem: Make) -> None:
    planner = guide_planner("mine_elsewhere", problem())
    with pytest.raises(Cancelled):
        planner.find(Budget(cancelled=lambda: True), np.random.default_rng(0))


def test_an_unknown_name_lists_the_known_ones(problem: Make) -> None:
    with pytest.raises(InvalidInput, match="unknown guide planner; known: rrt, prm") as caught:
        guide_planner("psychic", problem())
    assert caught.value.field == "stages.guide"


@pytest.fixture
def example(install: Install) -> str:
    """Name of the example's guide planner, which is installed."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    points = project["entry-points"][GUIDE_PLANNERS.group]
    install(EXAMPLE, project["name"], points)
    (name,) = points
    return str(name)


@pytest.mark.parametrize("low", [-0.4, 0.2])
def test_the_example_plans(
    example: str, hyq_data: RobotData, make_box: Callable[..., list[Surface]], low: float
) -> None:
    """Past a wall in the straight path, and straight where the wall is at the side."""
    wall = make_box("wall", np.array([1.1, low - 0.6, 0.0]), np.array([1.3, low, 2.0]))
    scene = Scene([make_surface("ground", GROUND, 0.5), *wall])
    request = PlanRequest(
        start=Placement.parse((0, 0, 0.62)),
        goal=Placement.parse((2.4, 0, 0.62)),
        bounds=BOUNDS,
        required_limbs=LEGS,
        start_limbs=LEGS,
        robustness_threshold=5.0,
        stages=StageNames(guide=example),
    )
    outcome = plan(request, hyq_data, scene, Budget(60.0))
    assert outcome.statistics.versions["sidestep"] == "1.2"
    assert outcome.statistics.time["shortcut"] > 0
    sideways = np.abs(outcome.guide.nodes[:, 1]).max()
    assert (sideways > 0.2) == (low > 0)


def test_the_documents_show_the_example() -> None:
    page = (EXAMPLE.parents[1] / "docs" / "guide.md").read_text()
    module = (EXAMPLE / "sidestep.py").read_text()
    for line in (
        "def sidestep(problem: GuideProblem) -> GuidePlanner:",
        "    return RootGuidePlanner(problem, SidestepSearch)",
    ):
        assert line in module
        assert line in page
    assert 'sidestep = "sidestep:sidestep"' in (EXAMPLE / "pyproject.toml").read_text()
    assert 'sidestep = "sidestep:sidestep"' in page
