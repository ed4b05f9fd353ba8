import html
import json
import os
import shutil
import signal
import threading
import time
import warnings
from html.parser import HTMLParser

import dynains
import pytest


@pytest.fixture(scope="module")
def finished(drive, tmp_path_factory):
    out = tmp_path_factory.mktemp("run") / "out"
    return dynains.run(drive, out, view=True)


def read_labels(folder):
    return {file.name: file.read_bytes() for file in sorted((folder / "labels").iterdir())}


def test_a_run_writes_its_results(drive, finished, street):
    assert finished.scans == len(street)
    assert finished.points == sum(len(scan.points) for scan in street)
    assert sum(finished.label_counts.values()) == finished.points
    assert finished.report == json.loads((finished.folder / "report.json").read_text())
    assert finished.report["complete"] and finished.report["sequence"] == str(drive)
    for file in finished.static_map, finished.moving_points, finished.picture, finished.page:
        assert file.is_file(), file
    assert len(read_labels(finished.folder)) == len(street) == len(list(finished.labels.iterdir()))
    assert repr(finished) == f"<dynains.RunResult: {len(street)} scans in {finished.folder}>"


def test_arguments_by_name(drive, tmp_path):
    config = dynains.Config.paper(map_voxel=0.5)
    counts = []
    result = dynains.run(
        drive,
        tmp_path / "out",
        config=config,
        start=2,
        end=6,
        map=tmp_path / "map.pcd",
        progress=lambda done, total: counts.append((done, total)),
        poses=drive / "poses_mm.txt",
        pose_units="mm",
    )
    assert result.scans == 5 and counts == [(done, 5) for done in range(6)]
    assert result.static_map == tmp_path / "map.pcd" and result.static_map.is_file()
    assert result.page is None
    assert result.report["configuration"]["map_voxel"] == 0.5
    assert result.report["configuration"]["decision"] == "window"
    flags = {"--poses": str(drive / "poses_mm.txt"), "--pose-units": "mm"}
    assert result.report["sequence_flags"] == flags
    # The page needs the options of the recording, which are those of the run.
    assert dynains.view(result).path.is_file()


@pytest.mark.parametrize(
    "arguments, error, text",
    [
        ({"forse": True}, dynains.ConfigError, "unknown parameter forse$"),
        ({"pose_unit": "mm"}, dynains.ConfigError, "unknown parameter pose_unit$"),
        (
            {"preset": "fast"},
            TypeError,
            "preset = 'fast': expected 'default', 'offline', 'paper' or 'published'",
        ),
        ({"preset": "paper", "config": dynains.Config()}, dynains.ConfigError, "not both"),
        ({"config": {"window": 4}}, TypeError, "expected a Config"),
        ({"config": dynains.Config(min_range=50, max_range=40)}, dynains.ConfigError, "min_range"),
        ({"progress": 3}, TypeError, "progress = 3: expected a function"),
        ({"start": -1}, dynains.ConfigError, "start: expected the number of a scan, found -1"),
        ({"start": 50}, dynains.ConfigError, "leave no scan"),
        ({"map": "map.txt"}, dynains.ConfigError, "map.txt"),
        ({"crs": "EPSG:25832"}, dynains.ConfigError, "las"),
    ],
)
def test_wrong_arguments_write_nothing(drive, tmp_path, arguments, error, text):
    with pytest.raises(error, match=text):
        dynains.run(drive, tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").glob("*.json"))


def test_arguments_are_checked_before_the_recording_is_read(tmp_path):
    with pytest.raises(dynains.ConfigError, match="map.txt"):
        dynains.run(tmp_path / "nowhere", tmp_path / "out", map="map.txt")
    with pytest.raises(dynains.IoError, match="nowhere"):
        dynains.run(tmp_path / "nowhere", tmp_path / "out")


def test_presets(drive, tmp_path):
    for name in "default", "offline", "paper", "published":
        report = dynains.run(drive, tmp_path / name, preset=name, end=2).report
        assert report["preset"] == name
        config = getattr(dynains.Config, name, dynains.Config)()
        assert report["configuration"] == config.to_dict()


def test_poses_that_do_not_fit(drive, tmp_path):
    poses = {"poses": drive / "poses_mm.txt"}
    with pytest.raises(dynains.ConfigError, match="pose-units"):
        dynains.run(drive, tmp_path / "out", **poses)
    with pytest.warns(RuntimeWarning, match="under the poses.*see: dynains check"):
        dynains.run(drive, tmp_path / "out", accept_poses=True, **poses)


def test_ctrl_c_ends_a_run_as_it_ends_the_program(drive, finished, tmp_path):
    def interrupt(done, total):
        if done == 3:
            for _ in range(2):  # a second one does not end the interpreter
                os.kill(os.getpid(), signal.SIGINT)

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt, match="3 scans"):
        dynains.run(drive, out, progress=interrupt)
    partial = tmp_path / "out.partial"
    report = json.loads((partial / "report.json").read_text())
    assert not report["complete"] and report["scans"] == 3
    assert len(read_labels(partial)) == 3 and not out.exists()
    with pytest.raises(dynains.IoError, match="was interrupted"):
        dynains.view(partial)
    assert dynains.run(drive, out).scans == finished.scans
    assert read_labels(out) == read_labels(finished.folder) and not partial.exists()
    with pytest.raises(KeyboardInterrupt, match="out.partial"):
        dynains.run(drive, out, force=True, progress=interrupt)
    assert read_labels(out) == read_labels(finished.folder)
    assert_python_has_the_signals_back()


def assert_python_has_the_signals_back():
    with pytest.raises(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(10)


def test_an_error_in_the_callback_ends_the_run(drive, finished, tmp_path):
    def fail(done, total):
        if done == 2:
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        dynains.run(drive, tmp_path / "out", progress=fail)
    dynains.run(drive, tmp_path / "out")
    assert read_labels(tmp_path / "out") == read_labels(finished.folder)


def test_others_run_during_a_check_and_a_view(drive, finished, no_switching):
    """A thread that is still at work when start() returns has released the lock."""
    for work in lambda: dynains.check(drive), lambda: dynains.view(finished):
        thread = threading.Thread(target=work)
        thread.start()
        assert thread.is_alive()
        thread.join()


def test_a_report_with_unknown_flags_is_refused(drive, tmp_path):
    dynains.run(drive, tmp_path / "out", end=3)
    report = json.loads((tmp_path / "out/report.json").read_text())
    for flag in "--nonsense", "-":
        report["sequence_flags"] = {flag: "1"}
        (tmp_path / "out/report.json").write_text(json.dumps(report))
        with pytest.raises(dynains.ConfigError, match="unknown parameter"):
            dynains.view(tmp_path / "out")


def test_runs_in_threads(drive, finished, tmp_path, no_switching):
    """Others run during a run; two runs at once give what one gives, and leave the signals alone."""
    recording = dynains.Recording(drive)
    threads = [
        threading.Thread(target=dynains.run, args=(recording, tmp_path / str(i))) for i in range(2)
    ]
    for thread in threads:
        thread.start()
    assert any(thread.is_alive() for thread in threads)
    for thread in threads:
        thread.join()
    for i in range(2):
        assert read_labels(tmp_path / str(i)) == read_labels(finished.folder)
    assert_python_has_the_signals_back()


class Frames(HTMLParser):
    """The attributes of each iframe, unescaped."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        assert tag == "iframe"
        self.found.append(dict(attributes))


def test_a_view_is_a_page_in_a_notebook_and_a_path_elsewhere(finished):
    view = dynains.view(finished.folder, height=300)
    assert view.path == finished.folder / "view.html" and view.height == 300
    assert os.fspath(view) == str(view.path)
    assert repr(view) == f"<dynains.View: {view.path}>"
    (frame,) = Frames(view._repr_html_()).found
    assert frame["srcdoc"] == view.path.read_text() and "height: 300px" in frame["style"]
    assert html.escape("<script>") in view._repr_html_()


def test_a_view_needs_the_recording(drive, tmp_path):
    moved = shutil.copytree(drive, tmp_path / "drive")
    dynains.run(moved, tmp_path / "out", end=4)
    moved.rename(tmp_path / "elsewhere")
    with pytest.raises(dynains.IoError, match="drive"):
        dynains.view(tmp_path / "out")
    assert dynains.view(tmp_path / "out", tmp_path / "elsewhere").path.is_file()
    with pytest.raises(dynains.IoError, match="nowhere: cannot be opened"):
        dynains.view(tmp_path / "nowhere")
    with pytest.raises(dynains.IoError, match="report.json: not found"):
        dynains.view(drive)


def test_warnings_can_be_errors(drive, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning):
            dynains.run(
                drive, tmp_path / "out", accept_poses=True, poses=drive / "poses_mm.txt"
            )
