"""A planner, the example executive that walks a scenario, and a recorder of what they exchange.

ros2 launch rbprm_ros demo.launch.py scenario:=replanning rviz:=true

Takes the arguments of planner.launch.py too. All ends when the executive is at the goal.
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
    "robot": ("talos", "the scenario's, so that its data are ready"),
    "namespace": ("", "of all nodes, such as robot1"),
    "scenario": ("replanning", "a known name, or the path of a scenario file"),
    "bag": (f"demo_{datetime.now():%Y%m%d_%H%M%S}", "folder to be made"),
}


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` runs."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    planner = IncludeLaunchDescription(PythonLaunchDescriptionSource(str(PLANNER)))
    return LaunchDescription([*declared, planner, OpaqueFunction(function=peers)])


def peers(context: LaunchContext) -> list[Node]:
    """Executive and recorder."""
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
