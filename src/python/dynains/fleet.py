"""Cleans many recordings at once, on the cores of one machine or on many machines, by Dask.

    dynains fleet LOGS... --out OUT [--city CITY] [--scheduler tcp://HOST:PORT]

A recording is a task. Its results go to OUT/NAME, as `dynains run` writes them, so they do not
depend on the workers, their number, or the order. A task of a worker that dies is given to another
worker. A recording that fails does not stop the others; OUT/fleet.json tells the reason. The same
command again runs over those that have no results yet.
"""

import argparse
import fcntl
import json
import os
import secrets
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, Optional, Tuple, TypeVar, Union

from . import ConfigError, IoError, PoseError, Recording, UsageError, run

__all__ = ["clean", "find_recordings"]

_REPORT = "fleet.json"
_PATIENCE = 600.0  # s, for a folder that another process holds

_LOGS = {".mcap", ".db3", ".bag"}
_SCANS = {".bin", ".pcd", ".ply", ".las", ".npy", ".xyz", ".csv"}
_SCAN_FOLDERS = {"velodyne", "pcd", "ply", "scans", "points", "clouds", "lidar", "samples"}
_MARKERS = {"report.json"}  # results of dynains, which are no recordings

PathLike = Union[str, "os.PathLike[str]"]
Result = TypeVar("Result")


def find_recordings(paths: Iterable[PathLike]) -> Dict[str, Path]:
    """Recordings by the name of their results.

    paths: recordings, or folders of recordings. What looks like a recording in a folder counts as
    one, also if it does not open: its result is the error. Raises IoError for a path that is
    neither, for two recordings of one name, and for names of files of a fleet.
    """
    found: Dict[str, Path] = {}
    for path in map(Path, paths):
        for recording in _recordings_at(path):
            name = recording.stem if recording.is_file() else recording.name
            _check_name(name, recording)
            if found.get(name, recording) != recording:
                raise IoError(
                    f"{recording}: has the same name as {found[name]}; results go to a folder of "
                    "that name, so rename one of them"
                )
            found[name] = recording
    if not found:
        raise IoError("no recording was named")
    return found


def _check_name(name: str, recording: PathLike) -> None:
    if name == _REPORT:
        raise IoError(
            f"{recording}: its results would have the name of a file of the fleet, {name}; rename it"
        )


def _recordings_at(path: Path) -> List[Path]:
    path = path.resolve()
    if not path.exists():
        raise IoError(f"{path}: no such recording")
    if not path.is_dir() or _opens(path):
        return [path]
    entries = sorted(entry for entry in path.iterdir() if not entry.name.startswith("."))
    recordings = [entry for entry in entries if _opens(entry) or _looks_like_one(entry)]
    if not recordings:
        raise IoError(f"{path}: neither a recording nor a folder of recordings")
    return recordings


def _opens(path: Path) -> bool:
    try:
        Recording(path)
    except (IoError, ConfigError, PoseError):
        return False
    return True


def _looks_like_one(path: Path) -> bool:
    """Whether a path that does not open has files of a recording. Results are none."""
    if path.is_file():
        return bool(_LOGS & set(path.suffixes))
    try:
        names = {entry.name for entry in path.iterdir()}
    except OSError:
        return True  # nobody knows what it holds
    if _MARKERS & names:
        return False
    if "metadata.yaml" in names or _SCAN_FOLDERS & {name.lower() for name in names}:
        return True
    return any((_LOGS | _SCANS) & set(Path(name).suffixes) for name in names)


def _when_free(work: Callable[[], Result]) -> Result:
    """Calls `work`; if another process holds the folder, again until it does not.

    A worker that was taken for dead may still hold it. Raises UsageError if it does so too long.
    """
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            return work()
        except UsageError:
            if time.monotonic() > end:
                raise
            time.sleep(1.0)


# The functions below run on workers. Errors are results: another attempt would fail, too.
_ERRORS = (ConfigError, IoError, PoseError, UsageError)


def _clean_one(recording: str, out: str, arguments: Dict[str, Any]) -> Dict[str, Any]:
    """Runs over one recording, unless OUT has its results. Returns them, or the error."""
    try:
        report = _finished(Path(out), arguments)
        if report is None:
            report = _when_free(lambda: run(recording, out, **arguments)).report
    except _ERRORS as error:
        return {"recording": recording, "error": str(error)}
    result = {key: report[key] for key in ("scans", "points", "labels")}
    warnings = report.get("doubts", {}).get("warnings", [])
    return {"recording": recording, **result, "warnings": warnings}


def _finished(out: Path, arguments: Dict[str, Any]) -> Optional[Dict[str, Any]]:
    """The report of a finished run by these arguments, as far as it has them; None without one.

    Raises UsageError if it tells of others.
    """
    try:
        report = json.loads((out / "report.json").read_text())
    except (OSError, ValueError):
        return None
    if not isinstance(report, dict) or not report.get("complete"):
        return None
    made = {"preset": report.get("preset"), **report.get("request", {})}
    for name, otherwise in (("preset", "default"), ("update", None), ("session", None)):
        wanted = arguments.get(name, otherwise)
        if made.get(name) != wanted:
            raise UsageError(
                f"{out}: holds results with {name} {made.get(name)}, not {wanted}; choose another --out"
            )
    return report


@contextmanager
def _locked(out: Path):
    """Raises UsageError if another fleet works in the folder."""
    out.mkdir(parents=True, exist_ok=True)
    folder = os.open(out, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise UsageError(f"{out}: another fleet works in this folder") from error
        yield
    finally:
        os.close(folder)


def _check_report(file: Path) -> None:
    """Raises IoError unless it is the report of a fleet, or nothing."""
    if not os.path.lexists(file):
        return
    try:
        is_report = all("recording" in result for result in json.loads(file.read_text()).values())
    except (OSError, ValueError, AttributeError, TypeError):
        is_report = False
    if file.is_symlink() or not is_report:
        raise IoError(f"{file}: was not written by a fleet; move it away, or choose another folder")


def _write_report(out: Path, results: Dict[str, Dict[str, Any]]) -> None:
    text = json.dumps({name: results[name] for name in sorted(results)}, indent=2) + "\n"
    staged = out / f".{_REPORT}.{secrets.token_hex(8)}.tmp"
    with open(staged, "x") as file:  # no file or link of others
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(staged, out / _REPORT)


def clean(
    recordings: Dict[str, Path],
    out: PathLike,
    *,
    city: Optional[PathLike] = None,
    scheduler: Optional[str] = None,
    workers: Optional[int] = None,
    progress: Optional[Callable[[int, int, str, Dict[str, Any]], object]] = None,
    **arguments: Any,
) -> Dict[str, Dict[str, Any]]:
    """Cleans recordings into OUT/NAME and writes OUT/fleet.json, which it returns.

    recordings: by name, see find_recordings(). out: a folder that all workers reach. city: folder
    of a map of many sessions that each recording is added to, under its name. scheduler: address of
    a scheduler of Dask, or its scheduler file (.json); None: workers on this machine. workers:
    their number on this machine; None: one for each core. progress: called with the numbers of
    finished and of all recordings, the name of the one that finished and its result. arguments: of
    dynains.run().

    Raises ImportError without Dask, UsageError if another fleet works in the folder, OSError if the
    scheduler does not answer.
    """
    from distributed import Client, LocalCluster

    out = Path(out).resolve()
    for name, path in recordings.items():
        _check_name(name, path)
    common = {**arguments, "one_thread": True}
    jobs = {
        name: (str(path), str(out / name), {**common, **_session(city, name)})
        for name, path in recordings.items()
    }
    with _locked(out):
        _check_report(out / _REPORT)
        cluster = scheduler or LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=None
        )
        is_file = isinstance(cluster, str) and cluster.endswith(".json")
        with Client(scheduler_file=cluster) if is_file else Client(cluster) as client:
            results = _results_of(client, jobs, progress)
        if scheduler is None:
            cluster.close()
        _write_report(out, results)
    return {name: results[name] for name in sorted(results)}


def _results_of(
    client: Any,
    jobs: Dict[str, Tuple[str, str, Dict[str, Any]]],
    progress: Optional[Callable[[int, int, str, Dict[str, Any]], object]],
) -> Dict[str, Dict[str, Any]]:
    from distributed import as_completed

    # The longest first, so that no worker is left with one at the end.
    order = sorted(jobs, key=lambda name: (-_size_of(Path(jobs[name][0])), name))
    names = {client.submit(_clean_one, *jobs[name], pure=False): name for name in order}
    results: Dict[str, Dict[str, Any]] = {}
    for task in as_completed(names):
        name = names.pop(task)
        error = task.exception()
        result = {"recording": jobs[name][0], "error": f"{error}"} if error else task.result()
        results[name] = result
        if progress:
            progress(len(results), len(jobs), name, result)
    return results


def _session(city: Optional[PathLike], name: str) -> Dict[str, str]:
    return {} if city is None else {"update": str(Path(city).resolve()), "session": name}


def _size_of(path: Path) -> int:
    if path.is_file():
        return path.stat().st_size
    return sum(file.stat().st_size for file in path.rglob("*") if file.is_file())


def _tell(done: int, total: int, name: str, result: Dict[str, Any]) -> None:
    outcome = f"failed: {result['error']}" if "error" in result else f"{result['scans']} scans"
    for warning in result.get("warnings", []):
        outcome += f"; warning: {warning}"
    print(f"{done} of {total} recordings: {name}: {outcome}", file=sys.stderr, flush=True)


def main(words: Optional[List[str]] = None) -> int:
    """0; 1 if a recording failed; 2 for wrong arguments."""
    parser = argparse.ArgumentParser(
        prog="dynains fleet", description="Clean many recordings at once, by Dask."
    )
    parser.add_argument("logs", nargs="+", help="recordings, or folders of recordings")
    parser.add_argument("--out", required=True, help="folder that all workers reach")
    parser.add_argument("--city", help="map of many sessions that each recording is added to")
    parser.add_argument(
        "--scheduler",
        help="address or scheduler file (.json) of a scheduler [workers on this machine]",
    )
    parser.add_argument("--workers", type=int, help="on this machine [one for each core]")
    parser.add_argument("--preset", default="default", choices=["default", "offline", "paper", "published"])
    parser.add_argument("--accept-poses", action="store_true")
    options = parser.parse_args(words)
    if options.scheduler and options.workers:
        parser.error("--workers are those of this machine: not with --scheduler")
    if options.workers is not None and options.workers < 1:
        parser.error(f"--workers {options.workers}: expected at least 1")
    try:
        results = clean(
            find_recordings(options.logs),
            options.out,
            city=options.city,
            scheduler=options.scheduler,
            workers=options.workers,
            progress=_tell,
            preset=options.preset,
            accept_poses=options.accept_poses,
        )
    except ImportError as error:
        print(f"dynains fleet: {error}; Debian has it as python3-distributed", file=sys.stderr)
        return 1
    except (IoError, OSError) as error:
        print(f"dynains fleet: {error}", file=sys.stderr)
        return 1
    except UsageError as error:
        print(f"dynains fleet: {error}", file=sys.stderr)
        return 2
    return 1 if any("error" in result for result in results.values()) else 0


if __name__ == "__main__":
    # Workers import functions by the name of their module, which is not __main__ there.
    from dynains import fleet

    sys.exit(fleet.main())
