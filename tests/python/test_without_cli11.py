import shutil
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
def test_the_module_is_configured_without_cli11(tmp_path):
    """That only the program includes it, is a test of the package."""
    options = ["DISABLE_FIND_PACKAGE_CLI11=ON", "EXPORT_COMPILE_COMMANDS=ON"]
    flags = [f"-DCMAKE_{option}" for option in options]
    flags += [f"-DDYNAINS_BUILD_{part}=OFF" for part in ("TESTS", "EXAMPLES")]
    flags += ["-DDYNAINS_BUILD_PYTHON=ON", f"-DPython3_EXECUTABLE={sys.executable}"]
    done = subprocess.run(
        ["cmake", "-S", Path(__file__).parents[2], "-B", tmp_path, *flags],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    units = (tmp_path / "compile_commands.json").read_text()
    assert "dynains_python.dir" in units and "dynains_run.dir" in units
    assert "dynains_program.dir" not in units
