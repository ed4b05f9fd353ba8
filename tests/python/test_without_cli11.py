import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
def test_the_module_is_configured_and_compiled_without_cli11(tmp_path):
    """Preprocesses every source of the module where CLI11 is not found, and its header refuses."""
    trap = tmp_path / "trap"
    (trap / "CLI").mkdir(parents=True)
    for name in ("CLI.hpp", "App.hpp"):
        (trap / "CLI" / name).write_text('#error "CLI11 is not installed"\n')
    build = tmp_path / "build"
    options = {
        "CMAKE_DISABLE_FIND_PACKAGE_CLI11": "ON",
        "CMAKE_EXPORT_COMPILE_COMMANDS": "ON",
        "CMAKE_CXX_FLAGS": f"-I{trap}",
        "DYNAINS_BUILD_PYTHON": "ON",
        "DYNAINS_BUILD_TESTS": "OFF",
        "DYNAINS_BUILD_EXAMPLES": "OFF",
        "Python3_EXECUTABLE": sys.executable,
    }
    flags = [f"-D{name}={value}" for name, value in options.items()]
    done = subprocess.run(
        ["cmake", "-S", ROOT, "-B", build, *flags], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr

    units = json.loads((build / "compile_commands.json").read_text())
    sources = "".join(unit["command"] for unit in units)
    assert "dynains_python.dir" in sources and "dynains_run.dir" in sources
    assert "dynains_program.dir" not in sources
    for unit in units:
        if not Path(unit["file"]).exists():
            continue  # made by the build
        command = shlex.split(unit["command"])
        command[command.index("-o") + 1] = str(tmp_path / "dependencies")
        done = subprocess.run(
            [*command, "-M"], cwd=unit["directory"], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
