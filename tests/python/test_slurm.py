"""The script for Slurm, on a cluster of one node that the test starts."""

import os
import re
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import dynains
import pytest

pytest.importorskip("distributed")
SCRIPT = Path(__file__).parents[2] / "examples" / "slurm" / "fleet.sh"
PROGRAM = os.environ.get("DYNAINS_PROGRAM")
DAEMONS = ["munged", "slurmctld", "slurmd"]


def daemon(name):
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


pytestmark = [
    pytest.mark.skipif(not PROGRAM, reason="the program dynains is not built"),
    pytest.mark.skipif(
        not all(map(daemon, DAEMONS)), reason="no Slurm (Debian: slurm-wlm munge)"
    ),
    pytest.mark.skipif(os.geteuid() != 0, reason="slurmd needs root"),
]


def output_of(environment, *command, **options):
    return subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, text=True, **options
    ).stdout.strip()


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def slurm(tmp_path):
    """Environment for the commands of a cluster of this node."""
    folder = tmp_path / "slurm"
    folder.mkdir()
    folder.chmod(0o755)
    key = folder / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    name = socket.gethostname().split(".")[0]
    cores = os.cpu_count()
    (folder / "slurm.conf").write_text(
        f"""ClusterName=test
SlurmctldHost={name}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
ReturnToService=2
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName={name} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
"""
    )
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    program = folder / "bin"
    program.mkdir()
    (program / "dynains").symlink_to(PROGRAM)
    (program / "python3").symlink_to(sys.executable)
    environment["PATH"] = f"{program}:{environment['PATH']}"
    munge = [f"--{part}={folder}/munge.{part}" for part in ("socket", "log-file", "pid-file")]
    commands = [
        ["munged", "--foreground", "--force", f"--key-file={key}", f"--seed-file={folder}/seed"]
        + munge,
        ["slurmctld", "-D", "-c"],
        ["slurmd", "-D"],
    ]
    log = open(folder / "log", "w")
    processes = []

    def stop():
        for process in reversed(processes):
            process.terminate()
            process.wait(30)
        log.close()

    def starts(environment):
        end = time.monotonic() + 60
        while time.monotonic() < end:
            if output_of(environment, "sinfo", "--noheader", "--format=%t") == "idle":
                return True
            time.sleep(0.5)
        return False

    for command in commands:
        command[0] = daemon(command[0])
        processes.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log))
        time.sleep(0.5)
    if not starts(environment):
        stop()
        pytest.skip(f"Slurm does not start here: {(folder / 'log').read_text()[-500:]}")
    yield environment
    stop()


def final_state(job, environment):
    """State of a job that has ended. `sbatch --wait` would look after 2, 4, 8 ... s only."""
    end = time.monotonic() + 240
    while time.monotonic() < end:
        shown = output_of(environment, "scontrol", "--oneliner", "show", "job", job)
        state = re.search(r"JobState=(\w+)", shown)[1]
        if state not in ("PENDING", "CONFIGURING", "RUNNING", "COMPLETING"):
            return state
        time.sleep(0.5)
    return "no end"


def test_the_script_for_slurm_gives_the_results_of_single_runs(slurm, simulate, tmp_path):
    drives = tmp_path / "drives"
    for seed in range(2):
        simulate(drives / f"drive{seed}", "--scans", 20, "--seed", seed)
        dynains.run(drives / f"drive{seed}", tmp_path / "expected" / f"drive{seed}")
    job = [str(SCRIPT), *map(str, sorted(drives.iterdir())), "--out", str(tmp_path / "out")]
    command = ["sbatch", "--parsable", "--nodes=1", "--ntasks-per-node=2", "--output=job.log", *job]
    if os.cpu_count() < 2:
        command[3] = "--ntasks-per-node=1"
    state = final_state(output_of(slurm, *command, cwd=tmp_path, check=True), slurm)
    log = (tmp_path / "job.log").read_text()
    assert state == "COMPLETED", log
    assert "2 of 2 recordings" in log
    assert not list(tmp_path.glob("dask-*.json"))
    for seed in range(2):
        for file in (tmp_path / "expected" / f"drive{seed}").rglob("*.label"):
            same = tmp_path / "out" / file.relative_to(tmp_path / "expected")
            assert file.read_bytes() == same.read_bytes()
