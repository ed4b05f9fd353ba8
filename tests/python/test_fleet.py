import fcntl
import json
import os
import signal
import subprocess
import sys
import threading
import time

import dynains
import pytest

pytest.importorskip("distributed")
from dynains import fleet  # noqa: E402


@pytest.fixture(scope="module")
def drives(simulate, tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    for seed in range(3):
        simulate(folder / f"drive{seed}", "--scans", 20, "--seed", seed)
    simulate(folder / "drive3", "--scene", "crowd", "--scans", 100, "--seed", 3)
    broken = folder / "broken"
    (broken / "velodyne").mkdir(parents=True)
    (broken / "velodyne" / "000000.bin").write_bytes(b"x")
    (broken / "poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")
    return folder


def results_in(folder):
    """Bytes of labels, causes and maps; reports hold times."""
    files = sorted(f for f in folder.rglob("*") if f.suffix in (".label", ".cause", ".ply"))
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


@pytest.fixture(scope="module")
def expected(drives, tmp_path_factory):
    """Results of one process."""
    out = tmp_path_factory.mktemp("expected")
    for drive in drives.glob("drive*"):
        dynains.run(drive, out / drive.name)
    return results_in(out)


@pytest.fixture
def cluster(tmp_path):
    """The address of a scheduler, and its three workers, each a process."""
    file = tmp_path / "scheduler.json"
    with open(tmp_path / "log", "w") as log:

        def start(what, *flags):
            command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *flags]
            return subprocess.Popen(
                [*command, "--scheduler-file", str(file)], stdout=log, stderr=log
            )

        scheduler = start("scheduler", "--port", "0", "--no-dashboard")
        workers = [start("worker", "--nthreads", "1", "--no-nanny") for _ in range(3)]
        while not file.exists():
            time.sleep(0.1)
        yield json.loads(file.read_text())["address"], workers
        for process in [*workers, scheduler]:
            process.kill()
            process.wait()


def test_a_worker_that_dies_and_one_that_stops_change_no_byte(drives, expected, cluster, tmp_path):
    address, workers = cluster
    out = tmp_path / "out"
    disturbed = []

    def disturb():
        while not disturbed:
            disturbed.extend(out.glob("drive3.partial/labels/*.label"))
            time.sleep(0.01)
        workers[0].send_signal(signal.SIGKILL)
        workers[1].send_signal(signal.SIGSTOP)
        threading.Timer(10.0, workers[1].send_signal, [signal.SIGCONT]).start()

    threading.Thread(target=disturb, daemon=True).start()
    recordings = fleet.find_recordings(drives.glob("drive*"))
    results = fleet.clean(recordings, out, scheduler=address)
    assert disturbed and workers[0].wait() == -signal.SIGKILL
    assert not [name for name, result in results.items() if "error" in result]
    assert list(results) == [f"drive{seed}" for seed in range(4)]
    assert results_in(out) == expected
    assert json.loads((out / "fleet.json").read_text()) == results


def test_the_map_of_a_fleet_is_that_of_one_process(drives, tmp_path):
    def bytes_of(city):
        return {str(f.relative_to(city)): f.read_bytes() for f in city.rglob("*") if f.is_file()}

    some = {f"drive{seed}": drives / f"drive{seed}" for seed in range(3)}
    results = fleet.clean(some, tmp_path / "out", city=tmp_path / "city", workers=3)
    assert not [name for name, result in results.items() if "error" in result]
    (tmp_path / "alone").mkdir()
    for name in reversed(list(some)):
        dynains.run(some[name], tmp_path / "alone" / name, update=tmp_path / "map", session=name)
    assert bytes_of(tmp_path / "city") == bytes_of(tmp_path / "map")
    assert {"drive0.session", "drive1.session", "drive2.session"} == {f.name for f in (tmp_path / "city").iterdir()}


def test_a_worker_waits_for_a_folder_that_another_holds(drives, tmp_path, monkeypatch):
    monkeypatch.setattr(fleet, "_PATIENCE", 0.0)
    job = (str(drives / "drive1"), str(tmp_path / "out"), {})
    (tmp_path / "out.partial").mkdir()
    other = os.open(tmp_path / "out.partial", os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_SH)
    assert "is in use" in fleet._clean_one(*job)["error"]
    os.close(other)
    assert fleet._clean_one(*job)["scans"] == 20


def test_finished_recordings_are_not_run_again_and_never_taken_for_others(drives, tmp_path):
    job = (str(drives / "drive1"), str(tmp_path / "out"))
    first = fleet._clean_one(*job, {})
    label = tmp_path / "out" / "labels" / "000003.label"
    label.unlink()
    assert fleet._clean_one(*job, {}) == first
    assert not label.exists()
    assert "preset default, not paper" in fleet._clean_one(*job, {"preset": "paper"})["error"]
    assert "update None" in fleet._clean_one(*job, {"update": "/city", "session": "x"})["error"]
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    (tmp_path / "out" / "report.json").write_text(json.dumps({**report, "complete": False}))
    assert "holds earlier results" in fleet._clean_one(*job, {})["error"]


def test_a_recording_that_fails_is_reported_and_does_not_stop_the_others(drives, tmp_path, capsys):
    some = [str(drives / name) for name in ("broken", "drive1", "drive2", "absent")]
    assert fleet.main([*some, "--out", str(tmp_path / "out"), "--workers", "2"]) == 1
    report = json.loads((tmp_path / "out" / "fleet.json").read_text())
    assert "000000.bin: truncated at byte" in report["broken"]["error"]
    assert "absent: " in report["absent"]["error"]
    assert [report[name]["scans"] for name in ("drive1", "drive2")] == [20, 20]
    assert report["drive1"]["warnings"] == []
    assert "4 of 4 recordings" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_the_warnings_of_a_run_are_part_of_its_result(drives, tmp_path):
    job = (str(drives / "drive1"), str(tmp_path / "out"))
    result = fleet._clean_one(*job, {"pose_units": "mm", "accept_poses": True})
    assert any("see: dynains check" in warning for warning in result["warnings"])


def test_wrong_arguments_of_a_fleet(drives, tmp_path, capsys):
    with pytest.raises(SystemExit):
        fleet.main([str(drives / "drive1"), "--out", str(tmp_path / "out"), "--workers", "0"])
    assert "--workers: expected at least 1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert fleet.find_recordings([drives / "drive1", drives / "drive1"]).keys() == {"drive1"}


def test_a_report_of_others_is_not_replaced(drives, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    report = out / "fleet.json"
    precious = tmp_path / "precious.json"
    precious.write_text('{"drive1": {"recording": "drive1"}}')
    report.symlink_to(precious)
    with pytest.raises(dynains.IoError, match="was not written by a fleet"):
        fleet.clean({"drive1": drives / "drive1"}, out)
    report.unlink()
    for text in ("mine", '{"drive1": 3}', "[]"):
        report.write_text(text)
        with pytest.raises(dynains.IoError, match="was not written by a fleet"):
            fleet.clean({"drive1": drives / "drive1"}, out)
        assert report.read_text() == text
    assert os.listdir(out) == ["fleet.json"]


def test_recordings_of_one_name_are_refused(drives, tmp_path):
    other = tmp_path / "drive1"
    other.mkdir()
    for file in (drives / "drive1").iterdir():
        (other / file.name).symlink_to(file)
    with pytest.raises(dynains.IoError, match="has the same name as"):
        fleet.find_recordings([drives / "drive1", other])


def test_the_program_starts_a_fleet_and_says_what_it_lacks(drives, tmp_path):
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python3").symlink_to(sys.executable)
    path = f"{tmp_path / 'bin'}:{os.environ['PATH']}"

    def fleet_command(*words, cwd=None, **environment):
        command = [os.environ["DYNAINS_PROGRAM"], "fleet", *map(str, words)]
        environment = {**os.environ, "PATH": path, **environment}
        return subprocess.run(command, env=environment, capture_output=True, text=True, cwd=cwd)

    assert "usage: dynains fleet" in fleet_command("--help").stdout

    out = tmp_path / "out"
    data = tmp_path / "data"  # the current folder holds modules that nobody asked for
    data.mkdir()
    for name in ("dynains", "distributed", "json", "pickle", "multiprocessing", "socket"):
        (data / f"{name}.py").write_text("open('executed', 'w')")
    done = fleet_command(drives / "drive1", "--out", out, "--workers", "1", cwd=data)
    assert done.returncode == 0 and "1 of 1 recordings: drive1: 20 scans" in done.stderr
    assert json.loads((out / "fleet.json").read_text())["drive1"]["scans"] == 20
    assert not (data / "executed").exists()

    (tmp_path / "dynains.py").write_text("raise ImportError('not here')")
    missing = fleet_command("x", PYTHONPATH=str(tmp_path))
    assert missing.returncode == 1
    assert missing.stderr == (
        "dynains: error: fleet needs the Python module of dynains: not here\n"
    )
    no_python = fleet_command("x", PATH=str(tmp_path))
    assert no_python.returncode == 1 and "python3" in no_python.stderr
