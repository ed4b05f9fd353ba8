"""pip install --no-build-isolation ./src/python

Needs nothing from the network: setuptools, CMake, a compiler, Eigen, nlohmann-json, nanoflann,
libpng, zlib, pybind11 and NumPy as installed on the system. CMAKE_ARGS adds arguments for the
configuration by CMake, CMAKE_BUILD_ARGS for the build. DYNAINS_BUILD_DIR names a build folder whose
module is taken instead of a new one.
"""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from shutil import copytree, ignore_patterns

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parents[2]
HEADER = (ROOT / "include/dynains/version.hpp").read_text()
VERSION = re.search(r'kVersionString\[\] = "([^"]+)"', HEADER).group(1)


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        target = Path(self.get_ext_fullpath(extension.name)).resolve().parent
        if os.environ.get("DYNAINS_BUILD_DIR"):
            built = Path(os.environ["DYNAINS_BUILD_DIR"]) / "python/dynains"
            if not list(built.glob("_dynains*")):
                sys.exit(f"{built}: holds no module; build the target dynains_python first")
            copytree(built, target, ignore=ignore_patterns("__pycache__"), dirs_exist_ok=True)
            return
        build = Path(self.build_temp).resolve()
        build.mkdir(parents=True, exist_ok=True)
        options = {
            "CMAKE_BUILD_TYPE": "Release",
            "DYNAINS_PYTHON_PACKAGE_DIR": target,
            "Python3_EXECUTABLE": sys.executable,
            "DYNAINS_BUILD_PYTHON": "ON",
            "DYNAINS_BUILD_PROGRAM": "OFF",
            "DYNAINS_BUILD_TESTS": "OFF",
            "DYNAINS_BUILD_EXAMPLES": "OFF",
            "DYNAINS_INSTALL": "OFF",
        }
        command = ["cmake", str(ROOT)] + [f"-D{name}={value}" for name, value in options.items()]
        command += shlex.split(os.environ.get("CMAKE_ARGS", ""))
        subprocess.run(command, cwd=build, check=True)
        jobs = str(os.cpu_count() or 1)
        command = ["cmake", "--build", str(build), "--target", "dynains_python", "-j", jobs]
        command += shlex.split(os.environ.get("CMAKE_BUILD_ARGS", ""))
        subprocess.run(command, check=True)


setup(
    name="dynains",
    version=VERSION,
    description="Online removal of moving instances from LiDAR maps",
    license="MIT",
    python_requires=">=3.8",
    install_requires=["numpy"],
    ext_modules=[Extension("dynains._dynains", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
    packages=[],
    zip_safe=False,
)
