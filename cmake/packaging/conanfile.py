"""The libraries of this checkout for Conan 2: conan create dynains/cmake/packaging"""

import os
import re

from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load

LIBRARIES = ("LZ4", "ZSTD", "BZ2", "PROJ", "Z", "SQLITE3")
PARTS = ("PROGRAM", "PYTHON", "EXAMPLES", "TESTS")


class Dynains(ConanFile):
    name = "dynains"
    description = "Removes moving objects from LiDAR scans and maps online"
    license = "MIT"
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    default_options = {"shared": False, "fPIC": True}
    implements = ["auto_shared_fpic"]

    def _root(self):
        return os.path.join(self.recipe_folder, os.pardir, os.pardir)

    def set_version(self):
        header = load(self, os.path.join(self._root(), "include", "dynains", "version.hpp"))
        self.version = re.search(r'kVersionString\[\] = "([^"]*)"', header).group(1)

    def export_sources(self):
        for pattern in ("CMakeLists.txt", "LICENSE", "cmake/*", "include/*", "src/*"):
            copy(self, pattern, src=self._root(), dst=self.export_sources_folder)

    def requirements(self):
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("nanoflann/1.6.1")
        self.requires("nlohmann_json/3.11.3")

    def layout(self):
        cmake_layout(self)

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["DYNAINS_BUILD_COMPONENTS"] = "ON"
        for part in PARTS:
            toolchain.cache_variables["DYNAINS_BUILD_" + part] = "OFF"
        for library in LIBRARIES:
            toolchain.cache_variables["DYNAINS_WITH_" + library] = "OFF"
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", src=self.source_folder,
             dst=os.path.join(self.package_folder, "licenses"))
        CMake(self).install()

    def package_info(self):
        # The package brings its own dynainsConfig.cmake.
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs.append(os.path.join("lib", "cmake", "dynains"))
