"""A run of a batch, in the process that was started: which clips are to be encoded, workers, results, the manifest.

Only this process writes the manifest, and only when a clip's file is in its place. Clips that fail are noted and
do not stop the others. Drafts and coded segments of long clips, and inputs that were downloaded, lie in a folder
beside the outputs (the manifest, where those go to a URL), which goes when the run ends, or when the next one begins.

Dask does the rest: `Client.submit` with `priority` orders the tasks, and runs those of a worker that died again, as
often as its setting distributed.scheduler.allowed-failures says; `as_completed` gives results as they come;
`Client.wait_for_workers` waits for the first worker; the dashboard of a scheduler shows what each worker does.
"""

from __future__ import annotations

import logging
import multiprocessing.resource_tracker
import os
import shutil
import signal
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import athcodec
from athcodec.batch import tasks
from athcodec.batch.inputs import Item, identity, is_telling, remote_identity, sha256
from athcodec.batch.manifest import Manifest, ManifestError, Record, read_records
from athcodec.batch.tasks import Result, one_line
from athcodec.errors import AthError, MissingExtra
from athcodec.files.atomic import is_url, remove_leftovers_of, scratch_folder
from athcodec.files.plain import FilePath
from athcodec.files.shown import without_secrets
from athcodec.untyped import DaskObject, JsonObject

MANIFEST = "athcodec-batch.jsonl"
SCRATCH = "athcodec-batch"
SPLIT = 4  # segments
CONNECTING = 30  # Seconds to wait for a scheduler, and then for the first of its workers.
ENVIRONMENT = "distributed.nanny.pre-spawn-environ"
LOST = "scheduler: the connection was lost, expected one until the end; the same command goes on where this one ended"


class SchedulerError(AthError):
    """The scheduler cannot be reached, or has no worker when the run begins."""


@dataclass
class Outcome:
    """The result of a run.

    Attributes
    ----------
    done, failed : list of dict
        The records that it added to the manifest.
    kept : list of Item
        Clips whose files were up to date.
    seconds : float
        How long it took.
    """

    done: list[Record] = field(default_factory=list)
    failed: list[Record] = field(default_factory=list)
    kept: list[Item] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def bytes(self) -> int:
        """Bytes of all .ath files that the run wrote."""
        return sum(record["bytes"] for record in self.done)

    @property
    def raw_bytes(self) -> int:
        """Size of the positions in these files, uncompressed."""
        return sum(record["raw_bytes"] for record in self.done)


@dataclass(frozen=True)
class Todo:
    """Whether a clip has to be encoded.

    Attributes
    ----------
    item : Item
    reason : str
        Why; "" where its file is up to date.
    known : dict or None
        Its record in the manifest, where only the content of its input can show whether it has changed.
    """

    item: Item
    reason: str
    known: Record | None = None


def preview(
    items: Sequence[Item], output: FilePath, *, manifest: FilePath | None = None, redo: bool = False
) -> list[Todo]:
    """Return what `run` would do with each clip. Nothing is written.

    Parameters
    ----------
    items, output, manifest, redo
        As in `run`.

    Returns
    -------
    list of Todo
        One for each item.

    Raises
    ------
    ManifestError
        Where the manifest is none.
    OSError
        Where it cannot be read.
    """
    records = read_records(_manifest_path(output, manifest))
    return [_todo(item, records.get(_key(item, output)), redo) for item in items]


def run(
    items: Sequence[Item],
    output: FilePath,
    *,
    manifest: FilePath | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    split: int = SPLIT,
    verify: bool = False,
    redo: bool = False,
    report: Callable[[str], None] | None = None,
) -> Outcome:
    """Encode the clips of a batch whose .ath files are missing or not up to date.

    Parameters
    ----------
    items : sequence of Item
        The clips, from `find`.
    output : str or path
        The folder of the .ath files, a path or a URL.
    manifest : str or path, optional
        The file that records which clips are done, by default athcodec-batch.jsonl in `output`; pass it if `output` is
        a URL. A clip that the manifest has as done is kept if its settings and input are the same and its file has the
        recorded checksum or, behind a URL, what its server states of it is as recorded.
    workers : int, optional
        Processes on this machine, one per core by default.
    scheduler : str, optional
        Address of a Dask scheduler to use instead, whose workers have the same athcodec and see inputs and outputs
        under the same paths.
    split : int, optional
        A clip of more segments than this is coded that many segments at a time, by any workers.
    verify : bool, optional
        Open each file and decode every level of it before it is recorded.
    redo : bool, optional
        Encode all clips again, even those that are up to date.
    report : callable, optional
        Called with a line of text when a clip is done or has failed.

    Returns
    -------
    Outcome
        The clips that were encoded, kept and failed. A clip that fails does not stop the others.

    Raises
    ------
    MissingExtra
        If the package dask.distributed is missing.
    ManifestError
        If the manifest is in use by another run, or is no manifest.
    SchedulerError
        If the scheduler cannot be reached, or has no worker when the run begins.
    OSError
        If the manifest cannot be written.
    """
    if find_spec("distributed") is None:
        raise MissingExtra('batch: needs dask.distributed: pip install "athcodec[batch]"')
    start, outcome, say = time.monotonic(), Outcome(), report or (lambda line: None)
    manifest = _manifest_path(output, manifest)
    place = os.path.dirname(manifest) if is_url(output) else os.path.abspath(output)
    os.makedirs(place, exist_ok=True)
    with Manifest(manifest) as notes, scratch_folder(os.path.join(place, SCRATCH)) as folder:
        os.chmod(folder, 0o700)  # workers unpickle what lies there
        todo = []
        for item in items:
            entry = _todo(item, notes.records.get(_key(item, output)), redo)
            todo.append(entry) if entry.reason else outcome.kept.append(item)
        if outcome.kept:
            say(f"{len(outcome.kept)} kept, {len(todo)} to do")
        try:
            if todo:
                with _client(workers, scheduler) as client:
                    results = _results(client, todo, folder, split, verify)
                    for count, (item, result) in enumerate(results, 1):
                        say(f"[{count}/{len(todo)}] {item.name}: {_noted(item, result, output, notes, outcome)}")
        finally:
            _tidy(entry.item.output for entry in todo if not is_url(entry.item.output))
    outcome.seconds = time.monotonic() - start
    return outcome


def _manifest_path(output: FilePath, manifest: FilePath | None) -> str:
    if manifest is None and is_url(output):
        raise ManifestError(
            f"{without_secrets(output)}: got no manifest, expected a file of this machine where outputs go to a URL"
        )
    return os.path.abspath(manifest or os.path.join(output, MANIFEST))


def _tidy(outputs: Iterable[str]) -> None:
    """Remove the unfinished files that workers left beside these outputs when they were stopped."""
    folders: dict[str, list[str]] = {}
    for output in outputs:
        folder, name = os.path.split(output)
        folders.setdefault(folder, []).append(name)
    for folder, names in folders.items():
        remove_leftovers_of(folder, names)


def _key(item: Item, output: FilePath) -> str:
    """Return the manifest's name for an output: the directory may be moved with it."""
    if is_url(item.output):
        return item.output[len(os.fspath(output).rstrip("/")) + 1 :]
    return Path(os.path.relpath(item.output, output)).as_posix()


def _todo(item: Item, record: Record | None, redo: bool) -> Todo:
    """Return whether a clip has to be encoded, and why. `record` is what the manifest has of its last run, None for a
    new clip; with `redo`, every clip is encoded."""
    if redo or record is None:
        return Todo(item, "to be redone" if record else "new")
    if record["status"] != "done":
        return Todo(item, "failed before")
    if record["settings"] != item.settings:
        return Todo(item, "other settings")
    fault = _fault_of_output(item, record)
    return Todo(item, fault) if fault else _todo_by_input(item, record)


def _fault_of_output(item: Item, record: Record) -> str:
    """Return what is wrong with the output of a clip's earlier run, compared with that run's record: "output is
    missing", "output was changed", or "" if nothing is."""
    if is_url(item.output):
        try:
            return "" if remote_identity(item.output) == record.get("stored") else "output was changed"
        except AthError:
            return "output is missing"
    if not os.path.exists(item.output):
        return "output is missing"
    same = os.path.getsize(item.output) == record["bytes"] and sha256(item.output) == record["sha256"]
    return "" if same else "output was changed"


def _todo_by_input(item: Item, record: Record) -> Todo:
    """Return whether a clip whose output is intact has to be encoded again because its input has changed since the run
    of `record`."""
    before = {name: value for name, value in record["source"].items() if name != "sha256"}
    try:
        now = identity(item)
    except (OSError, AthError):
        return Todo(item, "input is missing")
    if record["input"] != item.shown or before != now:
        return Todo(item, "other input")
    if is_url(item.input) and not is_telling(now):
        return Todo(item, "input to be compared", record)
    return Todo(item, "")


# ---- workers ----


def _cluster(workers: int) -> DaskObject:
    """Start a Dask cluster of `workers` processes on this machine, with one thread each, and return it. Raises
    SchedulerError."""
    import dask
    import distributed

    environment = dict(dask.config.get(ENVIRONMENT))
    environment.pop("MALLOC_TRIM_THRESHOLD_", None)  # arrays would come from the system each time: half as fast
    private = True if find_spec("cryptography") else None  # TLS: a port that others on the machine cannot use
    try:
        with _interrupts_held_back(), dask.config.set({ENVIRONMENT: environment}):
            return distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                security=private,
                dashboard_address="127.0.0.1:0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
            )
    except (OSError, RuntimeError) as error:
        raise SchedulerError(f"workers: cannot be started: {one_line(error)}") from None


@contextmanager
def _client(workers: int | None, scheduler: str | None) -> Iterator[DaskObject]:
    """Yield a Dask client of the scheduler at the address `scheduler` or, without one, of `workers` processes on this
    machine, which end with the block. Raises SchedulerError."""
    import distributed

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # The manifest records workers that die.
    if scheduler is None:
        with _cluster(workers or os.cpu_count() or 1) as cluster, distributed.Client(cluster) as client:
            yield client
        return
    try:
        client = distributed.Client(scheduler, timeout=CONNECTING)
    except (OSError, ValueError) as error:
        raise SchedulerError(f"{scheduler}: {one_line(error)}, expected the address of a scheduler") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECTING)
        except TimeoutError:
            raise SchedulerError(f"{scheduler}: got no worker within {CONNECTING} s, expected at least one") from None
        yield client


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Keep Ctrl-C from threads that start in the block, and from all processes that these start.

    A terminal sends Ctrl-C to every process, but only this thread is meant to end the others. A Ctrl-C during the block
    takes effect here when the block ends.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    multiprocessing.resource_tracker.ensure_running()  # whoever starts it has interrupts let through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _results(
    client: DaskObject, todo: Sequence[Todo], folder: str, split: int, verify: bool
) -> Iterator[tuple[Item, Result]]:
    """Encode the clips of `todo` and yield (clip, result) as soon as each is done. `folder` is the scratch folder; a
    clip of more than `split` segments is coded that many at a time. Raises SchedulerError."""
    import distributed

    items: dict[str, Item] = {}  # by key of a future

    def submit(task: Callable[..., Result], item: Item, *arguments: Any, **options: Any) -> DaskObject:
        """Let the remaining steps of clips that were begun go before the others."""
        place, first = _folder(folder, item), task is not tasks.begin
        future = client.submit(task, item, place, *arguments, **options, pure=False, priority=first)
        items[future.key] = item
        return future

    for entry in todo:
        if not is_url(entry.item.output):
            os.makedirs(os.path.dirname(entry.item.output), exist_ok=True)
    options = {"split": split, "verify": verify, "version": athcodec.__version__}
    finished = distributed.as_completed(
        [submit(tasks.begin, entry.item, **options, known=entry.known) for entry in todo], loop=client.loop
    )
    for future in finished:
        item = items.pop(future.key)
        result = _result(future, item)
        _warn(item, result.pop("warnings", ()))
        if "draft" in result:
            segments = range(result["draft"])
            parts = [submit(tasks.code, item, list(segments[first : first + split])) for first in segments[::split]]
            finished.add(submit(tasks.finish, item, parts, verify=verify))
            continue
        shutil.rmtree(_folder(folder, item), ignore_errors=True)
        yield item, result


def _warn(item: Item, given: Iterable[tuple[type[Warning], str]]) -> None:
    """Give the warnings of a task in this process, each with the name of its clip."""
    for category, text in given:
        warnings.warn(text if item.shown in text else f"{item.shown}: {text}", category, stacklevel=2)


def _folder(folder: str, item: Item) -> str:
    """Return where the files of one clip are in the scratch folder."""
    return os.path.join(folder, item.fingerprint)


def _result(future: DaskObject, item: Item) -> Result:
    """Return the result of a clip's task; {"failed": reason} if it failed or its workers died. Raises SchedulerError if
    the scheduler was lost."""
    import distributed

    try:
        return future.result()
    except distributed.scheduler.KilledWorker as error:
        times = getattr(error, "allowed_failures", 0) + 1
        return {
            "failed": f"{item.shown}: {times} workers died that worked on it, expected none to; perhaps there "
            "is too little memory"
        }
    except Exception as error:
        if future.status == "cancelled":
            raise SchedulerError(LOST) from None
        return {"failed": one_line(error)}


def _noted(item: Item, result: Result, output: FilePath, notes: Manifest, outcome: Outcome) -> str:
    """Add a clip's result to the manifest `notes` and to `outcome`, and return it as a line of text. `output` is the
    folder of all outputs."""
    if "kept" in result:
        outcome.kept.append(item)
        return "kept"
    if "done" in result and is_url(item.output) and _fault_of_output(item, result["done"]):
        result = {
            "failed": f"{without_secrets(item.output)}: a worker has stored it, expected to find it there; "
            "workers need a file system that all share"
        }
    record: JsonObject = {
        "output": _key(item, output),
        "input": item.shown,
        "status": "done" if "done" in result else "failed",
        "settings": item.settings,
        "version": athcodec.__version__,
    }
    record |= result.get("done") or {"reason": result["failed"]}
    notes.add(record)
    if "done" not in result:
        outcome.failed.append(record)
        return f"failed: {record['reason']}"
    outcome.done.append(record)
    return f"{record['bytes']:,} bytes, {record['raw_bytes'] / record['bytes']:.1f} to 1"
