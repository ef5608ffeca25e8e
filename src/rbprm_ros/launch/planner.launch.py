"""Start the planner's node with the parameters of a robot, on request in a namespace and with RViz.

ros2 launch rbprm_ros planner.launch.py robot:=talos namespace:=robot1 rviz:=true

Arguments that are not given are taken from the parameter file.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import LifecycleNode, Node

from launch import LaunchContext, LaunchDescription

NAME = "rbprm_planner"
CONFIG = Path(get_package_share_directory("rbprm_ros")) / "config"
ARGUMENTS = {
    "robot": "known name of a robot, or path of a robot file",
    "params_file": "parameter file; by default config/ROBOT.yaml, if the robot has one",
    "namespace": "namespace of the node, such as robot1",
}
CHOICES = {
    "autostart": (
        "false: a lifecycle manager activates the node",
        ["", "true", "false"],
    ),
    "use_sim_time": ("true: the time is that of /clock", ["", "true", "false"]),
    "log_level": ("log level of the node", ["debug", "info", "warn", "error", "fatal"]),
    "rviz": ("true: start RViz, which shows surfaces, plan and robot", ["true", "false"]),
}
DEFAULTS = {"log_level": "info", "rviz": "false"}


def generate_launch_description() -> LaunchDescription:
    """The description that `ros2 launch` executes."""
    declared = [
        DeclareLaunchArgument(name, default_value="", description=text)
        for name, text in ARGUMENTS.items()
    ]
    declared += [
        DeclareLaunchArgument(
            name, default_value=DEFAULTS.get(name, ""), description=text, choices=choices
        )
        for name, (text, choices) in CHOICES.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])


def nodes(context: LaunchContext) -> list[Node]:
    """The nodes that the arguments request."""
    given = {n: LaunchConfiguration(n).perform(context) for n in (*ARGUMENTS, *CHOICES)}
    namespace = given["namespace"].strip("/")
    found = [planner(given, namespace)]
    if given["rviz"] == "true":
        found.append(rviz(f"/{namespace}" if namespace else ""))
    return found


def planner(given: dict[str, str], namespace: str) -> LifecycleNode:
    """The planner's node."""
    return LifecycleNode(
        package="rbprm_ros",
        executable="planner_node",
        name=NAME,
        namespace=namespace,
        output="screen",
        parameters=parameters(given),
        ros_arguments=["--log-level", f"{logger(namespace)}:={given['log_level']}"],
    )


def logger(namespace: str) -> str:
    """Name of the node's logger, in a namespace."""
    return ".".join([*namespace.split("/"), NAME]).lstrip(".")


def parameters(given: dict[str, str]) -> list[str | dict[str, str | bool]]:
    """The parameter file, where there is one, and the parameters set by arguments."""
    file = given["params_file"] or str(CONFIG / f"{given['robot'] or 'hyq'}.yaml")
    own: dict[str, str | bool] = {"robot": given["robot"]} if given["robot"] else {}
    for name in ("autostart", "use_sim_time"):
        if given[name]:
            own[name] = given[name] == "true"
    found: list[str | dict[str, str | bool]] = []
    if given["params_file"] or Path(file).is_file():  # the robot of a robot file has none
        found.append(file)
    return [*found, own] if own else found


def rviz(namespace: str) -> Node:
    """RViz with the topics of a planner in a namespace."""
    topics = (f"/{NAME}/markers", f"/{NAME}/guide_path")
    return Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", str(CONFIG / "planner.rviz")],
        remappings=[(topic, f"{namespace}{topic}") for topic in topics],
    )
