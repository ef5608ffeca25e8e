"""What the tests of the core share: robots with their data, scenes, and finished plans."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import NDArray

from rbprm_core.budget import Budget
from rbprm_core.outcome import Outcome
from rbprm_core.plan_conversion.states_to_plan import contact_plan
from rbprm_core.plan_record import ContactPlan
from rbprm_core.planner import plan
from rbprm_core.request import PlanRequest
from rbprm_core.robot import Robot, RobotDescription, load_description
from rbprm_core.robot.data import RobotData, load_robot_data
from rbprm_core.scenario import Scenario, load_scenario
from rbprm_core.scene import Scene, Surface, make_surface

Array = NDArray[np.float64]
Box = Callable[..., list[Surface]]

settings.register_profile("core", derandomize=True, deadline=None)
settings.load_profile("core")

BUILT_SEEDS = (0, 1, 2)
FEW_SAMPLES = {  # draws of a workspace, samples of a limb
    "anymal": (10_000, 8_000),
    "go2": (10_000, 4_000),
    "talos": (5_000, 5_000),
    "allegro": (10_000, 10_000),
}
CRAWLER_SAMPLES = (3_000, 3_000)  # where Talos has four limbs
DEMANDING = ("car", "stepladder")  # hardly anything is in reach there: with fewer, nothing is

LEG = """
 <link name="{leg}_hip">
  <inertial><mass value="0.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>
  </inertial></link>
 <link name="{leg}_thigh">
  <inertial><origin xyz="0 0 -0.12"/><mass value="1.0"/>
   <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  <collision><origin xyz="0 0 -0.13"/><geometry><box size="0.04 0.04 0.2"/></geometry></collision>
 </link>
 <link name="{leg}_shank">
  <inertial><origin xyz="0 0 -0.12"/><mass value="0.5"/>
   <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
  <collision><origin xyz="0 0 -0.1"/><geometry><box size="0.03 0.03 0.14"/></geometry></collision>
 </link>
 <link name="{leg}_foot">
  <collision><geometry><sphere radius="0.02"/></geometry></collision>
 </link>
 <joint name="{leg}_haa" type="revolute"><parent link="{parent}"/><child link="{leg}_hip"/>
  <origin xyz="{x} {y} 0"/><axis xyz="1 0 0"/>
  <limit lower="-0.6" upper="0.6" effort="100" velocity="10"/></joint>
 <joint name="{leg}_hfe" type="revolute"><parent link="{leg}_hip"/><child link="{leg}_thigh"/>
  <axis xyz="0 1 0"/><limit lower="-1.4" upper="1.4" effort="100" velocity="10"/></joint>
 <joint name="{leg}_kfe" type="revolute"><parent link="{leg}_thigh"/><child link="{leg}_shank"/>
  <origin xyz="0 0 -0.25"/><axis xyz="0 1 0"/>
  <limit lower="{bend[0]}" upper="{bend[1]}" effort="100" velocity="10"/></joint>
 <joint name="{leg}_ankle" type="fixed"><parent link="{leg}_shank"/><child link="{leg}_foot"/>
  <origin xyz="0 0 -0.25"/></joint>
"""

BODY = """<robot name="toy">
 <link name="trunk">
  <inertial><mass value="20"/><inertia ixx="0.5" ixy="0" ixz="0" iyy="0.5" iyz="0" izz="0.5"/>
  </inertial>
  <collision><geometry><box size="0.5 0.24 0.12"/></geometry></collision>
 </link>
 <link name="chest">
  <inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>
  </inertial>
 </link>
 <joint name="waist" type="revolute"><parent link="trunk"/><child link="chest"/>
  <origin xyz="0.1 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-0.4" upper="0.4" effort="100" velocity="10"/></joint>
{legs}</robot>
"""

TOY = """name = "toy"
urdf = "{urdf}"
root_joints = ["waist"]
[reference_posture]
{posture}
[volumes]
trunk_links = ["trunk"]
trunk_scale = 1.0
samples = 4000
{limbs}"""

TOY_LIMB = """
[[limbs]]
name = "{leg}"
first_joint = "{leg}_haa"
effector = "{leg}_foot"
samples = 3000
contact = {{ type = "point", radius = 0.02 }}
"""

FRONT, HIND = (-2.2, -0.3), (0.3, 2.2)


@pytest.fixture(scope="session", autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A cache of the session's own, for subprocesses too."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RBPRM_CACHE_DIR", str(folder))
        yield folder


@pytest.fixture(scope="session")
def hyq(cache: Path) -> Robot:
    """HyQ as the package describes it."""
    return Robot.load(load_description("hyq"))


@pytest.fixture(scope="session")
def hyq_data(hyq: Robot) -> RobotData:
    """HyQ's data, computed once a session."""
    return load_robot_data(hyq)


@pytest.fixture(scope="session")
def small_hyq(cache: Path) -> RobotDescription:
    """HyQ with fewer samples: its data take a second."""
    return fewer_samples(load_description("hyq"), draws=1500, samples=300)


@pytest.fixture(scope="session")
def anymal_data(cache: Path) -> RobotData:
    """ANYmal's data from fewer samples than its file asks for."""
    return load_robot_data(
        Robot.load(fewer_samples(load_description("anymal"), *FEW_SAMPLES["anymal"]))
    )


@pytest.fixture(scope="session")
def go2_data(cache: Path) -> RobotData:
    """Go2's data from fewer samples than its file asks for."""
    return load_robot_data(Robot.load(fewer_samples(load_description("go2"), *FEW_SAMPLES["go2"])))


@pytest.fixture(scope="session")
def talos(cache: Path) -> Robot:
    """Talos as the package describes it, but for fewer samples: its data take seconds."""
    return Robot.load(fewer_samples(load_description("talos"), *FEW_SAMPLES["talos"]))


@pytest.fixture(scope="session")
def talos_data(talos: Robot) -> RobotData:
    """Talos's data, computed once a session."""
    return load_robot_data(talos)


@pytest.fixture(scope="session")
def crawler_data(cache: Path) -> RobotData:
    """Data of Talos on all fours, its torso's joints planned with the root, from few samples."""
    limbs = ("left_leg", "right_leg", "left_arm", "right_arm")
    text = load_description("talos").using(limbs, ("torso_1_joint", "torso_2_joint"))
    return load_robot_data(Robot.load(fewer_samples(text, *CRAWLER_SAMPLES)))


@pytest.fixture(scope="session")
def allegro_data(cache: Path) -> RobotData:
    """The Allegro hand's data from fewer samples than its file asks for."""
    return load_robot_data(
        Robot.load(fewer_samples(load_description("allegro"), *FEW_SAMPLES["allegro"]))
    )


@pytest.fixture(scope="session")
def scenario_data(cache: Path) -> Callable[[Scenario], RobotData]:
    """Makes the data of a scenario's robot, from fewer samples where it can do with them."""

    def load(scenario: Scenario) -> RobotData:
        text = scenario.load_robot().description
        few = FEW_SAMPLES.get(text.name)
        if few is not None and scenario.name not in DEMANDING:
            many_limbs = text.name == "talos" and len(text.limbs) > 3
            text = fewer_samples(text, *(CRAWLER_SAMPLES if many_limbs else few))
        return load_robot_data(Robot.load(text))

    return load


@pytest.fixture(scope="session")
def toy_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's own robot: primitives, no SRDF, front legs on a joint planned with the root."""
    folder = tmp_path_factory.mktemp("toy")
    legs, limbs, posture = [], [], ["waist = 0.0"]
    for leg, x, y in (("lf", 0.2, 0.2), ("rf", 0.2, -0.2), ("lh", -0.3, 0.2), ("rh", -0.3, -0.2)):
        front = leg[1] == "f"
        parent, bend = ("chest", FRONT) if front else ("trunk", HIND)
        legs.append(LEG.format(leg=leg, parent=parent, x=x, y=y, bend=bend))
        limbs.append(TOY_LIMB.format(leg=leg))
        sign = 1 if front else -1
        posture += [f"{leg}_hfe = {0.6 * sign}", f"{leg}_kfe = {-1.2 * sign}"]
    urdf = folder / "toy.urdf"
    urdf.write_text(BODY.format(legs="".join(legs)))
    path = folder / "toy.toml"
    path.write_text(TOY.format(urdf=urdf, posture="\n".join(posture), limbs="".join(limbs)))
    return path


@pytest.fixture(scope="session")
def toy_data(toy_file: Path, cache: Path) -> RobotData:
    """Data of the toy robot."""
    return load_robot_data(Robot.load(load_description(str(toy_file))))


@pytest.fixture(scope="session")
def rubble() -> Scenario:
    """The scenario `rubble`."""
    return load_scenario("rubble")


@pytest.fixture(scope="session")
def rubble_scene(rubble: Scenario) -> Scene:
    """The scene of the rubble."""
    return rubble.scene()


@pytest.fixture(scope="session")
def flat_scene() -> Scene:
    """One square of ground at z = 0, 10 m wide."""
    return Scene([square("ground", 5.0)])


@pytest.fixture(scope="session")
def outcomes(
    hyq_data: RobotData, rubble: Scenario, rubble_scene: Scene
) -> dict[int, tuple[PlanRequest, Outcome]]:
    """Requests and outcomes over the rubble, by seed."""
    found = {}
    for seed in BUILT_SEEDS:
        request = rubble.request_for(hyq_data.robot, seed)
        found[seed] = (request, plan(request, hyq_data, rubble_scene, Budget(60.0)))
    return found


@pytest.fixture(scope="session")
def rubble_plans(
    outcomes: dict[int, tuple[PlanRequest, Outcome]], hyq: Robot, rubble: Scenario
) -> dict[int, ContactPlan]:
    """The outcomes over the rubble as contact plans."""
    entry = rubble.environment_entry()
    return {
        seed: contact_plan(outcome, request, hyq, entry)
        for seed, (request, outcome) in outcomes.items()
    }


@pytest.fixture(scope="session")
def make_box() -> Box:
    """Makes the six outward faces of a box: `make_box(name, low, high)`."""
    return box


def fewer_samples(text: RobotDescription, draws: int, samples: int) -> RobotDescription:
    """A description that draws less."""
    volumes = text.volumes.model_copy(update={"samples": draws})
    limbs = tuple(limb.model_copy(update={"samples": samples}) for limb in text.limbs)
    return text.model_copy(update={"volumes": volumes, "limbs": limbs})


def square(name: str, half: float, height: float = 0.0, friction: float = 0.5) -> Surface:
    """A horizontal square about the z axis."""
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return make_surface(name, [(x, y, height) for x, y in corners], friction)


def box(name: str, low: Array, high: Array, friction: float = 0.5) -> list[Surface]:
    """The six faces of a box, normals outward."""
    faces = []
    for axis in range(3):
        for side, value in ((-1, low[axis]), (1, high[axis])):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            ring = np.zeros((4, 3))
            ring[:, axis] = value
            ring[:, u] = [low[u], high[u], high[u], low[u]]
            ring[:, v] = [low[v], low[v], high[v], high[v]]
            corners = ring if side > 0 else ring[::-1]
            faces.append(make_surface(f"{name}_{axis}{side:+d}", corners, friction))
    return faces


Planned = tuple[RobotData, Scene, PlanRequest, Outcome]


def planned(name: str, data: RobotData) -> Planned:
    text = load_scenario(name)
    request, scene = text.request_for(data.robot), text.scene()
    return data, scene, request, plan(request, data, scene, Budget(60.0))


@pytest.fixture(scope="session")
def climb(talos_data: RobotData) -> Planned:
    """Talos over a step of 20 cm: surfaces ground, riser and step."""
    return planned("step20", talos_data)


@pytest.fixture(scope="session")
def trot(hyq_data: RobotData) -> Planned:
    """HyQ on flat ground."""
    return planned("flat", hyq_data)
