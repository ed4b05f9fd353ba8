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
    tools = mock.Mock()
    sys.modules.update({"conan": mock.Mock(ConanFile=ConanFile), "conan.errors": tools,
                        "conan.tools": tools, "conan.tools.build": tools,
                        "conan.tools.cmake": tools, "conan.tools.files": tools})
    spec = importlib.util.spec_from_file_location("recipe", path)
    recipe = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(recipe)
    return recipe


def components_of(source):
    """Names of the compiled components, each with those that it links."""
    components = {}
    for path in sorted((source / "src").glob("*/CMakeLists.txt")):
        text = path.read_text()
        for name in re.findall(r"dynains_component\((\w+)", text):
            linked = re.search(rf"target_link_libraries\(dynains_{name} PUBLIC ([^)]*)\)", text)
            targets = linked.group(1).split() if linked else []
            names = {re.sub(r"dynains(::|_)", "", target) for target in targets}
            components[name] = names - {"dynains"}
    return components


def vcpkg_names(port, variable):
    return re.search(rf"foreach\({variable} ([^)]*)\)", port).group(1).split()


source = pathlib.Path(sys.argv[1])
packaging = source / "cmake" / "packaging"
for manifest in packaging / "package.xml", source / "examples" / "ros2" / "package.xml":
    root = ElementTree.parse(manifest).getroot()
    print(f"{manifest.relative_to(source)} {root.findtext('version')}")
print("vcpkg.json", json.loads((packaging / "vcpkg" / "vcpkg.json").read_text())["version"])
recipe = conan_recipe(packaging / "conanfile.py")
print("conandata.yml", *re.findall(r'^  "([^"]*)":$', (packaging / "conandata.yml").read_text(), re.M))
components = components_of(source)
if {name: set(links) for name, links in recipe.COMPONENTS.items()} != components:
    print("conanfile.py has components", recipe.COMPONENTS, "instead of", components)
package = recipe.DynainsConan()
package.settings = mock.Mock(os="Linux")
package.cpp_info = mock.MagicMock()
package.package_info()
port = (packaging / "vcpkg" / "portfile.cmake").read_text()
options = (source / "cmake" / "dynainsParts.cmake").read_text()
log_libraries = {name.upper() for name in re.findall(r"dynains_log_library\((\w+) [a-z]", options)}
for file, names in ("conanfile.py", recipe.LIBRARIES), ("vcpkg", vcpkg_names(port, "library")):
    if set(names) != log_libraries:
        print(file, "should leave out", *sorted(log_libraries), "and leaves out", *sorted(names))
arguments = json.loads((packaging / "colcon.meta").read_text())["names"]["dynains"]["cmake-args"]
known = set(re.findall(r"DYNAINS_\w+", options))
named = {argument[2:].split("=")[0] for argument in arguments if "DYNAINS_" in argument}
named |= {"DYNAINS_BUILD_" + part for part in (*recipe.PARTS, *vcpkg_names(port, "part"))}
if not named <= known:
    print("recipes name unknown options", *sorted(named - known))
