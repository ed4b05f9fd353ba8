"""Recipe of Conan 2 for an index of packages. When `sources` of conandata.yml are filled in:

    conan create dynains/cmake/packaging --version 1.0.0
"""

import os

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir

required_conan_version = ">=2.0.9"

LIBRARIES = ("LZ4", "ZSTD", "BZ2", "Z", "SQLITE3")
PARTS = ("PROGRAM", "PYTHON", "EXAMPLES", "TESTS")
# Each compiled component and those that it links.
COMPONENTS = {
    "remover": (),
    "io": (),
    "surfaces": (),
    "poses": ("io", "surfaces"),
    "recording": (),
    "odometry": ("remover", "surfaces"),
    "city": ("io", "surfaces", "recording"),
    "evaluation": (),
}


class DynainsConan(ConanFile):
    name = "dynains"
    description = "Removes moving objects from LiDAR scans and maps online"
    license = "MIT"
    url = "https://github.com/conan-io/conan-center-index"
    homepage = "https://github.com/OWNER/dynains"
    topics = ("lidar", "slam", "mapping", "point-cloud", "robotics")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    default_options = {"shared": False, "fPIC": True}
    implements = ["auto_shared_fpic"]

    def layout(self):
        cmake_layout(self, src_folder="src")

    def requirements(self):
        self.requires("eigen/3.4.0", transitive_headers=True)
        self.requires("nanoflann/1.6.1")
        self.requires("nlohmann_json/3.11.3")

    def validate(self):
        check_min_cppstd(self, 17)
        if self.settings.os == "Windows":
            raise ConanInvalidConfiguration("dynains needs a POSIX system")

    def source(self):
        get(self, **self.conan_data["sources"][self.version], strip_root=True)

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
        for folder in os.path.join("lib", "cmake"), os.path.join("lib", "pkgconfig"), "share":
            rmdir(self, os.path.join(self.package_folder, folder))

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "dynains")
        core = self.cpp_info.components["core"]
        core.set_property("cmake_target_name", "dynains::dynains")
        core.set_property("pkg_config_name", "dynains")
        core.requires = ["eigen::eigen"]
        if self.settings.os in ("Linux", "FreeBSD"):
            core.system_libs = ["m", "pthread", "dl"]
        for name, links in COMPONENTS.items():
            component = self.cpp_info.components[name]
            component.set_property("cmake_target_name", "dynains::" + name)
            component.libs = ["dynains_" + name]
            component.requires = ["core", *links]
        # Headers alone, in source files alone.
        self.cpp_info.components["surfaces"].requires.append("nanoflann::nanoflann")
        self.cpp_info.components["evaluation"].requires.append("nlohmann_json::nlohmann_json")
