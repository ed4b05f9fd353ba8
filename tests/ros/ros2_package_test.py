"""ros2_package_test.py SOURCE: finds what does not fit together in the package of ROS 2.

It needs no ROS. The launch file runs with stand-ins of launch and launch_ros. ROS itself ignores
the value of a parameter that no node declares.
"""

import importlib.util
import pathlib
import re
import runpy
import sys
from unittest import mock
from xml.etree import ElementTree

SOURCE = pathlib.Path(sys.argv[1])
PACKAGE = SOURCE / "examples" / "ros2"
NODE = (PACKAGE / "src" / "remover_node.cpp").read_text()
CMAKE = (PACKAGE / "CMakeLists.txt").read_text()
MANIFEST = ElementTree.parse(PACKAGE / "package.xml").getroot()
DECLARED = set(re.findall(r'(?:declare|FixedParameters\(node\))\(\s*\{"(\w+)"', NODE))


def expect(names, known, what):
    unknown = sorted(set(names) - set(known))
    assert names and not unknown, f"{what}: {unknown} of {sorted(set(names))}"


def stand_ins(nodes, arguments, used):
    launch, launch_ros = mock.MagicMock(), mock.MagicMock()
    launch.LaunchDescription = list
    launch.actions.DeclareLaunchArgument = lambda name, **_: arguments.append(name)
    launch.substitutions.LaunchConfiguration = used.append
    launch_ros.descriptions.ComposableNode = lambda **values: nodes.append(values)
    modules = {"launch": launch, "launch_ros": launch_ros}
    for name in "actions", "substitutions", "descriptions", "parameter_descriptions":
        modules["launch." + name] = getattr(launch, name)
        modules["launch_ros." + name] = getattr(launch_ros, name)
    return modules


def check_launch_file():
    nodes, arguments, used = [], [], []
    with mock.patch.dict(sys.modules, stand_ins(nodes, arguments, used)):
        launch_file = runpy.run_path(str(PACKAGE / "launch" / "remover.launch.py"))
        launch_file["generate_launch_description"]()
    expect(used, arguments, "arguments of the launch file")
    (node,) = nodes
    expect([node["package"]], [MANIFEST.findtext("name")], "package")
    expect([node["plugin"]], re.findall(r"REGISTER_NODE\(([\w:]+)\)", NODE), "component")
    expect([node["plugin"]], re.findall(r'register_nodes\(\w+ "([\w:]+)"\)', CMAKE), "component")
    values = [name for value in node["parameters"] if isinstance(value, dict) for name in value]
    expect(values, DECLARED | {"use_sim_time"}, "parameters of the launch file")


def check_files():
    values = (PACKAGE / "config" / "remover.yaml").read_text()
    expect(re.findall(r"^    (\w+):", values, re.M), DECLARED, "parameters of the file")
    depends = {entry.text for entry in MANIFEST if entry.tag.endswith("depend")}
    needs = set(re.search(r"set\(dynains_ros2_packages ([^)]*)\)", CMAKE).group(1).split())
    needs |= set(re.findall(r"find_package\((\w+) .*REQUIRED", CMAKE))
    launch_file = (PACKAGE / "launch" / "remover.launch.py").read_text()
    needs |= set(re.findall(r"^from (\w+)", launch_file, re.M))
    assert depends == needs, f"dependencies: {sorted(depends ^ needs)}"
    expect([MANIFEST.findtext("name")], re.findall(r"^project\((\w+)", CMAKE, re.M), "project")


USERS = {"examples/ros_common": r"loop_\.|config\.|text\.|diagnosis\.|(?:worker|maps)_->",
         "include/dynains": r"dynains::|frame\."}


def check_names():
    for folder, users in USERS.items():
        headers = "".join(path.read_text() for path in (SOURCE / folder).rglob("*.hpp"))
        names = re.findall(rf"\b(?:{users})(\w+)", NODE)
        expect(names, re.findall(r"\w+", headers), f"names of {folder}")


def check_manifests():
    if importlib.util.find_spec("catkin_pkg") is None:
        return
    from catkin_pkg.package import parse_package
    for folder in PACKAGE, SOURCE / "cmake" / "packaging":
        warnings = []
        parse_package(str(folder), warnings=warnings)
        assert not warnings, warnings


check_launch_file()
check_files()
check_names()
check_manifests()
