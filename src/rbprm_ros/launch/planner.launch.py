"""The planner's node with the parameters of a robot; managed start if asked for.

ros2 launch rbprm_ros planner.launch.py robot:=talos autostart:=false
"""

from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import LifecycleNode
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """What `ros2 launch` runs."""
    share = FindPackageShare("rbprm_ros")
    robot = LaunchConfiguration("robot")
    parameters = PathJoinSubstitution([share, "config", [robot, ".yaml"]])
    autostart = ParameterValue(LaunchConfiguration("autostart"), value_type=bool)
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robot", default_value="hyq", description="name of config/*.yaml"
            ),
            DeclareLaunchArgument(
                "autostart", default_value="true", description="false: a manager activates it"
            ),
            LifecycleNode(
                package="rbprm_ros",
                executable="planner_node",
                name="rbprm_planner",
                namespace="",
                output="screen",
                parameters=[parameters, {"autostart": autostart}],
            ),
        ]
    )
