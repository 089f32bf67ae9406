"""A run of a batch, in the process that was started: which clips are to be encoded, workers, results, the manifest.

Only this process writes the manifest, and only when a clip's file is in its place. Clips that fail are noted and
do not stop the others. Drafts and coded segments of long clips, and inputs that were downloaded, lie in a folder
beside the outputs (the manifest, where those go to a URL), which goes when the run ends, or when the next one begins.
"""

from __future__ import annotations

import logging
import multiprocessing.resource_tracker
import os
import queue
import secrets
import shutil
import signal
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import athcodec
from athcodec.batch import tasks
from athcodec.batch.inputs import Item, identity, is_telling, remote_identity, sha256
from athcodec.batch.manifest import Manifest, ManifestError, Record, read_records
from athcodec.batch.show import Show
from athcodec.batch.tasks import Result, one_line
from athcodec.errors import AthError, MissingExtra
from athcodec.files.atomic import is_url, remove_leftovers_of, scratch_folder
from athcodec.files.plain import FilePath
from athcodec.files.shown import without_secrets

MANIFEST = "athcodec-batch.jsonl"
SCRATCH = "athcodec-batch"
SPLIT = 4  # segments
PATIENCE = 0.25  # seconds between looks at the scheduler
CONNECTING = 30  # seconds, to a scheduler, and of a scheduler without workers
ENVIRONMENT = "distributed.nanny.pre-spawn-environ"
LOST = "scheduler: the connection was lost, expected one until the end; the same command goes on where this one ended"


class SchedulerError(AthError):
    """The scheduler, or all of its workers, cannot be reached."""


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
        """Size of all files that it wrote."""
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
    show: Show | None = None,
) -> Outcome:
    """Encode those clips of a batch whose files are not up to date.

    Parameters
    ----------
    items : sequence of Item
        See `find`.
    output : str or path
        The directory of their outputs, a path or a URL.
    manifest : str or path, optional
        The manifest, athcodec-batch.jsonl in `output` by default; it must be given where that is a URL. A clip that it
        has as done, with the same settings and input, and whose file has the recorded checksum, is kept; of a file
        behind a URL, what its server says must be as recorded.
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
        Keep nothing.
    show : Show, optional
        How the run is followed; not at all by default.

    Returns
    -------
    Outcome
        Also with the clips that failed: they do not stop the others.

    Raises
    ------
    MissingExtra
        Where dask.distributed is missing.
    ManifestError
        Where the manifest is in use, or is none.
    SchedulerError
        Where the scheduler, or all workers, cannot be reached.
    OSError
        Where the manifest cannot be written.
    """
    if find_spec("distributed") is None:
        raise MissingExtra('batch: needs dask.distributed: pip install "athcodec[batch]"')
    start, outcome, show = time.monotonic(), Outcome(), show or Show()
    manifest = _manifest_path(output, manifest)
    place = os.path.dirname(manifest) if is_url(output) else os.path.abspath(output)
    os.makedirs(place, exist_ok=True)
    with Manifest(manifest) as notes, scratch_folder(os.path.join(place, SCRATCH)) as folder:
        os.chmod(folder, 0o700)  # workers unpickle what lies there
        todo = []
        for item in items:
            entry = _todo(item, notes.records.get(_key(item, output)), redo)
            todo.append(entry) if entry.reason else outcome.kept.append(item)
        show.begin([entry.item for entry in todo], len(outcome.kept))
        try:
            if todo:
                with _client(workers, scheduler) as client:
                    _Run(client, output, folder, notes, outcome, show, split, verify).all(todo)
        finally:
            _tidy(entry.item.output for entry in todo if not is_url(entry.item.output))
            show.end()
    outcome.seconds = time.monotonic() - start
    return outcome


def _manifest_path(output: FilePath, manifest: FilePath | None) -> str:
    if manifest is None and is_url(output):
        raise ManifestError(
            f"{without_secrets(output)}: got no manifest, expected a file of this machine where outputs go to a URL"
        )
    return os.path.abspath(manifest or os.path.join(output, MANIFEST))


def _tidy(outputs: Iterable[str]) -> None:
    """Removes the unfinished files of workers that were stopped."""
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
    if redo or record is None:
        return Todo(item, "to be redone" if record else "new")
    if record["status"] != "done":
        return Todo(item, "failed before")
    if record["settings"] != item.settings:
        return Todo(item, "other settings")
    fault = _fault_of_output(item, record)
    return Todo(item, fault) if fault else _todo_by_input(item, record)


def _fault_of_output(item: Item, record: Record) -> str:
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


def _cluster(workers: int) -> Any:
    """Processes on this machine, with one thread each. Raises SchedulerError."""
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
def _client(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """A client of Dask: of a scheduler that is there, or of processes of our own, which go with it."""
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
    """Threads that begin in the block, and processes that they start at any time, never see Ctrl-C, which a terminal
    sends to all: this thread ends them. It sees one that came meanwhile at the end."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    multiprocessing.resource_tracker.ensure_running()  # whoever starts it has interrupts let through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Run:
    """The clips that workers encode, and their results."""

    def __init__(
        self,
        client: Any,
        output: str,
        folder: str,
        notes: Manifest,
        outcome: Outcome,
        show: Show,
        split: int,
        verify: bool,
    ):
        self.client, self.output, self.folder, self.notes = client, output, folder, notes
        self.outcome, self.show, self.split, self.verify = outcome, show, split, verify
        self.topic = f"{SCRATCH}-{secrets.token_hex(8)}"
        self.seen_workers = time.monotonic()
        self.finished: queue.SimpleQueue = queue.SimpleQueue()
        self.pending: dict[str, tuple[Item, str, Any]] = {}  # by key: the clip, what is done with it, the future
        self.parts: dict[str, list[Any]] = {}  # futures of a long clip's segments, by output

    def all(self, todo: Sequence[Todo]) -> None:
        """Until each clip is in the manifest."""
        outputs = {entry.item.fingerprint: entry.item.output for entry in todo}

        def show(event: tuple[float, dict[str, Any]]) -> None:
            self.show.stage(outputs[event[1]["clip"]], event[1]["stage"], event[1]["fraction"])

        self.client.subscribe_topic(self.topic, show)
        try:
            for entry in todo:
                if not is_url(entry.item.output):
                    os.makedirs(os.path.dirname(entry.item.output), exist_ok=True)
                self._submit(
                    entry.item,
                    "begin",
                    tasks.begin,
                    self._folder(entry.item),
                    split=self.split,
                    verify=self.verify,
                    version=athcodec.__version__,
                    topic=self.topic,
                    known=entry.known,
                )
            while self.pending:
                self._take()
        finally:
            self.client.unsubscribe_topic(self.topic)

    def _folder(self, item: Item) -> str:
        """Paths of one clip in the scratch folder."""
        return os.path.join(self.folder, item.fingerprint)

    def _submit(self, item: Item, what: str, function: Any, *arguments: Any, **options: Any) -> Any:
        """Put the remaining steps of clips that were begun first."""
        future = self.client.submit(function, item, *arguments, **options, pure=False, priority=what != "begin")
        self.pending[future.key] = item, what, future
        future.add_done_callback(self.finished.put)
        return future

    def _take(self) -> None:
        """One result, if one comes soon."""
        try:
            future = self.finished.get(timeout=PATIENCE)
        except queue.Empty:
            self._check_scheduler()
            return
        self.seen_workers = time.monotonic()
        item, what, _ = self.pending.pop(future.key)
        result = self._result(future, item)
        if "draft" in result:
            self._code(item, result["draft"])
        elif what == "code":
            done = self.parts.get(item.output, [future])
            left = sum(part.key in self.pending for part in done)
            self.show.stage(item.output, "motion", 1 - left / len(done))
        else:
            self._note(item, result)

    def _check_scheduler(self) -> None:
        if self.client.status != "running":
            raise SchedulerError(LOST)
        if self.client.scheduler_info()["workers"]:
            self.seen_workers = time.monotonic()
        elif time.monotonic() - self.seen_workers > CONNECTING:
            raise SchedulerError(
                f"scheduler: got no worker for {CONNECTING} s, expected at least one; the same "
                "command goes on where this one ended"
            )

    def _result(self, future: Any, item: Item) -> Result:
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

    def _code(self, item: Item, segments: int) -> None:
        """A long clip, some segments at a time, and its file when all are there."""
        folder = self._folder(item)
        groups = [list(range(first, min(first + self.split, segments))) for first in range(0, segments, self.split)]
        parts = [self._submit(item, "code", tasks.code, folder, group) for group in groups]
        self.parts[item.output] = parts  # kept until the file is there: a worker that dies may take results with it
        self._submit(item, "finish", tasks.finish, folder, parts, verify=self.verify, topic=self.topic)

    def _note(self, item: Item, result: Result) -> None:
        """A clip that is finished, or failed."""
        self.parts.pop(item.output, None)
        shutil.rmtree(self._folder(item), ignore_errors=True)
        if "kept" in result:
            self.outcome.kept.append(item)
            self.show.kept(item)
            return
        if "done" in result and is_url(item.output) and _fault_of_output(item, result["done"]):
            result = {
                "failed": f"{without_secrets(item.output)}: a worker has stored it, expected to find it there; "
                "workers need a file system that all share"
            }
        status = "done" if "done" in result else "failed"
        record = {
            "output": _key(item, self.output),
            "input": item.shown,
            "status": status,
            "settings": item.settings,
            "version": athcodec.__version__,
        }
        record |= result.get("done") or {"reason": result["failed"]}
        self.notes.add(record)
        (self.outcome.done if "done" in result else self.outcome.failed).append(record)
        self.show.finished(item, record)
