"""Cleans many recordings at once, on the cores of one machine or on many machines, by Dask.

    dynains fleet LOGS... --out OUT [--city CITY] [--scheduler tcp://HOST:PORT]

A recording is a task. Its results go to OUT/NAME, as `dynains run` writes them, so they do not
depend on the workers, their number, or the order. A task of a worker that dies is given to another
worker. A recording that fails does not stop the others; OUT/fleet.json has the reason. The same
command again runs over those that have no results yet.
"""

import argparse
import json
import os
import secrets
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, Optional, Union

from . import ConfigError, IoError, PoseError, UsageError, run

__all__ = ["clean", "find_recordings"]

_PATIENCE = 600.0  # s, for a folder that another process holds

PathLike = Union[str, "os.PathLike[str]"]
Results = Dict[str, Dict[str, Any]]


def find_recordings(paths: Iterable[PathLike]) -> Dict[str, Path]:
    """Recordings by the name of their results. Raises IoError for two recordings of one name."""
    found: Dict[str, Path] = {}
    for path in (Path(path).resolve() for path in paths):
        name = path.stem if path.is_file() else path.name
        if found.setdefault(name, path) != path:
            raise IoError(f"{path}: has the same name as {found[name]}; rename one of them")
    return found


def _clean_one(recording: str, out: str, arguments: Dict[str, Any]) -> Dict[str, Any]:
    """On a worker: runs over one recording, unless OUT has its results. Returns them, or the error.

    An error is a result, because another attempt would fail, too. A folder may be held by a worker
    that was taken for dead; then this waits.
    """
    end = time.monotonic() + _PATIENCE
    while True:
        try:
            report = _finished(Path(out), arguments) or run(recording, out, **arguments).report
            break
        except UsageError as error:
            if time.monotonic() > end:
                return {"recording": recording, "error": str(error)}
            time.sleep(1.0)
        except (ConfigError, IoError, PoseError) as error:
            return {"recording": recording, "error": str(error)}
    result = {key: report[key] for key in ("scans", "points", "labels")}
    return {"recording": recording, **result, "warnings": report["doubts"]["warnings"]}


def _finished(out: Path, arguments: Dict[str, Any]) -> Optional[Dict[str, Any]]:
    """The report of a finished run; None without one. Raises ConfigError if it is about others."""
    try:
        report = json.loads((out / "report.json").read_text())
    except (OSError, ValueError):
        return None
    if not report.get("complete"):
        return None
    made = {"preset": report.get("preset"), **report.get("request", {})}
    for name, otherwise in (("preset", "default"), ("update", None), ("session", None)):
        wanted = arguments.get(name, otherwise)
        if made.get(name) != wanted:
            raise ConfigError(
                f"{out}: holds results with {name} {made.get(name)}, not {wanted}; choose another --out"
            )
    return report


def _check_report(file: Path) -> None:
    """Raises IoError for a file of others."""
    if not os.path.lexists(file):
        return
    try:
        is_ours = all("recording" in result for result in json.loads(file.read_text()).values())
    except (OSError, ValueError, AttributeError, TypeError):
        is_ours = False
    if file.is_symlink() or not is_ours:
        raise IoError(f"{file}: was not written by a fleet; move it away, or choose another folder")


def clean(
    recordings: Dict[str, Path],
    out: PathLike,
    *,
    city: Optional[PathLike] = None,
    scheduler: Optional[str] = None,
    workers: Optional[int] = None,
    progress: Optional[Callable[[int, int, str, Dict[str, Any]], object]] = None,
    **arguments: Any,
) -> Results:
    """Cleans recordings into OUT/NAME and writes OUT/fleet.json, which it returns.

    recordings: by name, see find_recordings(). out: a folder that all workers reach. city: folder
    of a map of many sessions that each recording is added to, under its name. scheduler: address of
    a scheduler of Dask, or its scheduler file (.json); None: workers on this machine. workers:
    their number on this machine; None: one for each core. progress: called with the numbers of
    finished and of all recordings, the name of the one that finished and its result. arguments: of
    dynains.run().

    Raises ImportError without Dask, OSError if the scheduler does not answer, IoError for a
    fleet.json of others.
    """
    from distributed import Client, LocalCluster, as_completed

    out = Path(out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    _check_report(out / "fleet.json")
    results: Results = {}
    if scheduler is None:
        client = Client(LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None))
    else:
        client = Client(**{"scheduler_file" if scheduler.endswith(".json") else "address": scheduler})
    with client:
        names = {}
        for name, path in recordings.items():
            update = {} if city is None else {"update": str(Path(city).resolve()), "session": name}
            job = (str(path), str(out / name), {**arguments, "one_thread": True, **update})
            names[client.submit(_clean_one, *job, pure=False)] = name
        for task in as_completed(names):
            name, error = names[task], task.exception()
            failed = {"recording": str(recordings[name]), "error": str(error)}
            results[name] = failed if error else task.result()
            if progress:
                progress(len(results), len(names), name, results[name])
        if scheduler is None:
            client.cluster.close()
    results = {name: results[name] for name in sorted(results)}
    staged = out / f".fleet.json.{secrets.token_hex(8)}.tmp"
    with open(staged, "x") as file:  # no file or link of others
        json.dump(results, file, indent=2)
    os.replace(staged, out / "fleet.json")
    return results


def _tell(done: int, total: int, name: str, result: Dict[str, Any]) -> None:
    outcome = f"failed: {result['error']}" if "error" in result else f"{result['scans']} scans"
    warnings = "".join(f"; warning: {warning}" for warning in result.get("warnings", []))
    print(f"{done} of {total} recordings: {name}: {outcome}{warnings}", file=sys.stderr, flush=True)


def main(words: Optional[List[str]] = None) -> int:
    """0; 1 if a recording failed; 2 for wrong arguments."""
    parser = argparse.ArgumentParser(
        prog="dynains fleet", description="Clean many recordings at once, by Dask."
    )
    parser.add_argument("logs", nargs="+", help="recordings")
    parser.add_argument("--out", required=True, help="folder that all workers reach")
    parser.add_argument("--city", help="map of many sessions that each recording is added to")
    parser.add_argument(
        "--scheduler",
        help="address or scheduler file (.json) of a scheduler [workers on this machine]",
    )
    parser.add_argument("--workers", type=int, help="on this machine [one for each core]")
    parser.add_argument("--preset", default="default", choices=["default", "offline", "paper", "published"])
    parser.add_argument("--accept-poses", action="store_true")
    options = vars(parser.parse_args(words))
    if options["workers"] is not None and (options["scheduler"] or options["workers"] < 1):
        parser.error("--workers: expected at least 1, and no --scheduler, which has its own")
    try:
        results = clean(find_recordings(options.pop("logs")), progress=_tell, **options)
    except ImportError as error:
        print(f"dynains fleet: {error}; Debian has it as python3-distributed", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"dynains fleet: {error}", file=sys.stderr)
        return 1
    return 1 if any("error" in result for result in results.values()) else 0
