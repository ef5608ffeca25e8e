"""Start a planner, the example executive with a scenario, and a recorder of their messages.

ros2 launch rbprm_ros demo.launch.py scenario:=replanning rviz:=true

It accepts the arguments of planner.launch.py too, and ends when the executive is at the goal.
"""

from datetime import datetime
from pathlib import Path

from launch.actions import (
    DeclareLaunchArgument,
    IncludeLaunchDescription,
    OpaqueFunction,
    Shutdown,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from launch import LaunchContext, LaunchDescription

PLANNER = Path(__file__).parent / "planner.launch.py"
ARGUMENTS = {
    "robot": ("talos", "robot of the scenario, whose data are loaded at the start"),
    "namespace": ("", "namespace of all nodes, such as robot1"),
    "scenario": ("replanning", "known name of a scenario, or path of a scenario file"),
    "bag": (f"demo_{datetime.now():%Y%m%d_%H%M%S}", "new folder for the bag"),
}


def generate_launch_description() -> LaunchDescription:
    """The description that `ros2 launch` executes."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    planner = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(PLANNER)))
    return LaunchDescription([*declared, planner, OpaqueFunction(function=peers)])


def peers(context: LaunchContext) -> list[Node]:
    """The executive and the recorder."""
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    namespace = given["namespace"].strip("/")
    planner: dict[str, str | bool] = {
        "planner": f"/{namespace}/rbprm_planner" if namespace else "/rbprm_planner",
        "use_sim_time": LaunchConfiguration("use_sim_time", default="").perform(context) == "true",
    }
    executive = Node(
        package="rbprm_ros",
        executable="executive",
        namespace=namespace,
        output="screen",
        parameters=[planner | {"scenario": given["scenario"]}],
        on_exit=Shutdown(),
    )
    recorder = Node(
        package="rbprm_ros",
        executable="record_bag",
        namespace=namespace,
        output="screen",
        arguments=[given["bag"]],
        parameters=[planner],
    )
    return [recorder, executive]
