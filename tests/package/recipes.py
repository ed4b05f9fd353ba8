"""recipes.py SOURCE: prints "FILE VERSION" of each recipe of packagers, and what is wrong in others.

The recipes are read as their tools read them. Conan itself is not needed.
"""

import importlib.util
import json
import pathlib
import re
import sys
from unittest import mock
from xml.etree import ElementTree


class ConanFile:
    pass


def conan_recipe(path):
    tools = mock.Mock(load=lambda _, file: pathlib.Path(file).read_text())
    sys.modules.update({"conan": mock.Mock(ConanFile=ConanFile), "conan.tools": tools,
                        "conan.tools.cmake": tools, "conan.tools.files": tools})
    spec = importlib.util.spec_from_file_location("recipe", path)
    recipe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(recipe)
    package = recipe.Dynains()
    package.recipe_folder = str(path.parent)
    package.set_version()
    return package.version, recipe.LIBRARIES, recipe.PARTS


def vcpkg_names(port, variable):
    return re.search(rf"foreach\({variable} ([^)]*)\)", port).group(1).split()


source = pathlib.Path(sys.argv[1])
packaging = source / "cmake" / "packaging"
for manifest in packaging / "package.xml", source / "examples" / "ros2" / "package.xml":
    root = ElementTree.parse(manifest).getroot()
    print(f"{manifest.relative_to(source)} {root.findtext('version')}")
print("vcpkg.json", json.loads((packaging / "vcpkg" / "vcpkg.json").read_text())["version"])
version, libraries, parts = conan_recipe(packaging / "conanfile.py")
print("conanfile.py", version)
port = (packaging / "vcpkg" / "portfile.cmake").read_text()
options = (source / "cmake" / "dynainsParts.cmake").read_text()
log_libraries = {name.upper() for name in re.findall(r"dynains_log_library\((\w+) [a-z]", options)}
for recipe, names in ("conanfile.py", libraries), ("vcpkg", vcpkg_names(port, "library")):
    if set(names) != log_libraries:
        print(recipe, "should leave out", *sorted(log_libraries), "and leaves out", *sorted(names))
arguments = json.loads((packaging / "colcon.meta").read_text())["names"]["dynains"]["cmake-args"]
known = set(re.findall(r"DYNAINS_\w+", options))
named = {argument[2:].split("=")[0] for argument in arguments if "DYNAINS_" in argument}
named |= {"DYNAINS_BUILD_" + part for part in (*parts, *vcpkg_names(port, "part"))}
if not named <= known:
    print("recipes name unknown options", *sorted(named - known))
