"""recipes.py SOURCE: prints "FILE VERSION" of each recipe of packagers, and what is wrong in others.

The recipes are read as their tools read them. Conan itself is not needed.
"""

import importlib.util
import json
import pathlib
import sys
from unittest import mock
from xml.etree import ElementTree


class ConanFile:
    pass


def conan_version(path):
    tools = mock.Mock(load=lambda _, file: pathlib.Path(file).read_text())
    sys.modules.update({"conan": mock.Mock(ConanFile=ConanFile), "conan.tools": tools,
                        "conan.tools.cmake": tools, "conan.tools.files": tools})
    spec = importlib.util.spec_from_file_location("recipe", path)
    recipe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(recipe)
    package = recipe.Dynains()
    package.recipe_folder = str(path.parent)
    package.set_version()
    return package.version


source = pathlib.Path(sys.argv[1])
packaging = source / "cmake" / "packaging"
for manifest in packaging / "package.xml", source / "examples" / "ros2" / "package.xml":
    root = ElementTree.parse(manifest).getroot()
    print(f"{manifest.relative_to(source)} {root.findtext('version')}")
print("vcpkg.json", json.loads((packaging / "vcpkg" / "vcpkg.json").read_text())["version"])
print("conanfile.py", conan_version(packaging / "conanfile.py"))
arguments = json.loads((packaging / "colcon.meta").read_text())["names"]["dynains"]["cmake-args"]
parts = (source / "cmake" / "dynainsParts.cmake").read_text()
for option in {argument[2:].split("=")[0] for argument in arguments}:
    if option.startswith("DYNAINS_") and option not in parts:
        print("colcon.meta names the unknown option", option)
