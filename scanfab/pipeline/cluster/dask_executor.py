"""dask_executor(): frames go to the workers of a Dask cluster."""

from __future__ import annotations

import logging
import threading
import uuid
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import Executor, Future, InvalidStateError, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakSet

from scanfab.base.errors import ScanfabError, SettingsError, warn
from scanfab.base.spelling import counted
from scanfab.io.families import PathLike
from scanfab.pipeline.cluster.connection import (
    ClusterError,
    Pulse,
    address_in,
    blind,
    check_that_one_listens,
    connected,
    outdated,
    unloadable,
)
from scanfab.pipeline.cluster.on_worker import (
    Failed,
    Outdated,
    computed_there,
    file_of,
    scanned_there,
    versions_here,
    view_there,
)
from scanfab.pipeline.cluster.packed import Packed
from scanfab.scan.scan import spread_over

NEEDS = "a Dask cluster needs the package distributed: pip install 'scanfab[cluster]'"
# of a frame that raises errors, or takes its worker down
TRIES = 3


class FrameJob(Protocol):
    """What :class:`DaskExecutor` sends away."""

    @property
    def strict(self) -> FrameJob: ...

    def given_up(self, error: Exception) -> Any: ...

    def __call__(self, threads: int) -> Any: ...


@contextmanager
def dask_executor(
    scheduler: str | None = None, *, scheduler_file: PathLike | None = None
) -> Iterator[DaskExecutor]:
    """
    Connect to a Dask cluster: an executor for :func:`scanfab.compute` and the other functions.

    Workers read the files of their frames themselves, so they see the same files by the same paths.
    A worker that dies costs its frame again. A frame that raises an error is tried on other workers
    before that counts. A single frame, or fewer than half as many as the workers have threads, is
    read here; its axes and replicates go to the workers, and its packing once to each.

    Parameters
    ----------
    scheduler : str, optional
        Its address, such as ``tcp://10.0.0.5:8786``.
    scheduler_file : path, optional
        In its place the file that ``dask scheduler --scheduler-file``, ``dask-mpi`` and
        ``dask-jobqueue`` write.

    Yields
    ------
    DaskExecutor
        Until the end of the block.

    Raises
    ------
    ScanfabError
        If no scheduler answers, or workers have other versions or do not see the files.
    SettingsError
        If not just one of the two is named, or distributed is not installed.

    Examples
    --------
    >>> import scanfab
    >>> def fabric(folder, address):
    ...     with scanfab.dask_executor(address) as executor:
    ...         return scanfab.compute(scanfab.read_series(folder), executor=executor)
    """
    if (scheduler is None) == (scheduler_file is None):
        raise SettingsError("a cluster is named by just one of `scheduler` and `scheduler_file`")
    try:
        import distributed
    except ImportError:
        raise SettingsError(NEEDS) from None
    connect: Any = distributed.Client
    address = address_in(Path(scheduler_file)) if scheduler_file is not None else str(scheduler)
    with _quiet():
        check_that_one_listens(address)
        client = connected(connect, address)
        executor = DaskExecutor(client, address)
        try:
            executor.check_versions()
            yield executor
        finally:
            executor.shutdown()
            client.close(timeout=2)


@contextmanager
def _quiet() -> Iterator[None]:
    """What Dask would print of lost connections is told once, by us."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


class DaskExecutor(Executor):
    """Sends frames to the workers of a Dask cluster; as :func:`dask_executor` makes it."""

    def __init__(self, client: Any, address: str) -> None:
        self.client = client
        self.address = address
        self.name = f"scanfab-{uuid.uuid4().hex[:12]}"
        self._here = ThreadPoolExecutor(4)
        self.pulse = Pulse(client, address, self._move_on)
        self._number = 0
        self._seen: set[str] = set()
        self._starts: Counter[str] = Counter()
        self._trials: WeakSet[_Trial] = WeakSet()
        self._lock = threading.Lock()
        with self.gone_if_lost():
            client.subscribe_topic(self.name, self._note_start)
            self.pulse.start()

    def __repr__(self) -> str:
        workers = self.workers()
        return f"DaskExecutor {self.address}: {counted(len(workers), 'worker')}"

    def workers(self) -> dict[str, int]:
        """The threads of each worker, as they were a moment ago."""
        return self.pulse.threads

    def room(self) -> int:
        """How many frames may be under way: one for each thread, and for each worker the next."""
        workers = self.workers()
        return max(sum(workers.values()) + len(workers), 1)

    def share(self, number: int) -> int:
        """How many threads each of so many frames has; if but one, it goes to a worker whole."""
        return max(sum(self.workers().values()) // number, 1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a frame computed by one worker, or by the threads of several."""
        (threads,) = args
        job: Any = fn
        if threads > 1:
            return self._here.submit(self._spread, job, threads)
        self._check_files(job)
        trial = _Trial(self, job)
        with self._lock:
            self._trials.add(trial)
        with self.gone_if_lost():
            trial.send()
        return trial.future

    def shutdown(self, wait: bool = False, *, cancel_futures: bool = True) -> None:
        """Leave what is under way; the cluster goes on for others."""
        self.pulse.stop()
        self._here.shutdown(wait=wait, cancel_futures=cancel_futures)

    def send(self, function: Callable[..., Any], *args: Any, among: Collection[str] = ()) -> Any:
        """A future of Dask; one of some workers computes it, if they are there."""
        with self._lock:
            self._number += 1
            key = f"{self.name}-{self._number}"
        return self.client.submit(
            function, *args, key=key, pure=False, workers=list(among) or None,
            allow_other_workers=bool(among),
        )  # fmt: skip

    def _move_on(self) -> None:
        """Frames bound to workers that are gone: Dask would never give them to later ones."""
        with self._lock:
            trials = list(self._trials)
        for trial in trials:
            trial.move_on()

    def _note_start(self, event: tuple[float, str]) -> None:
        """A worker has begun with what a future of this key stands for."""
        self._starts[event[1]] += 1

    def starts(self, key: str) -> int:
        """How many workers have begun with what a future stood for; then that is forgotten."""
        return self._starts.pop(key, 0)

    @contextmanager
    def gone_if_lost(self) -> Iterator[None]:
        """What fails in the block because the scheduler is lost is told as that."""
        try:
            yield
        except ScanfabError:
            raise
        except Exception as error:
            if isinstance(error, OSError | TimeoutError) or self.client.status != "running":
                raise self.pulse.gone() from None
            raise

    def check_versions(self) -> None:
        """ClusterError if workers have other versions than this process."""
        mine = versions_here()
        with self.gone_if_lost():
            found = self.client.run(versions_here, on_error="return")
        for worker, theirs in found.items():
            if isinstance(theirs, OSError | TimeoutError):
                # it is ending just now
                continue
            if isinstance(theirs, BaseException):
                raise unloadable(worker, theirs, mine["scanfab"])
            if theirs != mine:
                raise outdated(worker, theirs, mine)
        if not found:
            # a warning, so that --quiet shows it too: nothing else tells why nothing happens
            warn(
                f"{self.address}: the scheduler has no workers yet: frames wait for them, "
                f"without a limit: start some with `dask worker {self.address}`"
            )

    def _check_files(self, job: Any) -> None:
        """ClusterError if workers do not see the file of the first frame of a series."""
        path = file_of(job)
        if path is None or job.source in self._seen:
            return
        self._seen.add(job.source)
        with self.gone_if_lost():
            views = self.client.run(view_there, str(path), on_error="return")
        those = {worker: view for worker, view in views.items() if view and isinstance(view, str)}
        if those and path.exists():
            who = f"{counted(len(those), 'worker')} of {len(views)}"
            raise blind(who, path, *next(iter(those.items())))

    def _spread(self, job: Any, threads: int) -> Any:
        """Compute a frame here, whose scans are done there."""
        with spread_over(_Parts(self).map):
            return job(threads)


class _Trial:
    """One frame, tried until it is computed or given up."""

    def __init__(self, executor: DaskExecutor, job: FrameJob) -> None:
        self.executor = executor
        self.job = job
        self.future: Future[Any] = Future()
        self.failures: list[tuple[str, Exception]] = []
        """Worker and error of each try."""
        self._among: set[str] = set()
        """The workers that it is bound to while one of them is there; none for any."""
        self._sent: Any = None

    def send(self) -> None:
        """Try it, on a worker that has not failed with it, if there is one."""
        executor = self.executor
        failed = {worker for worker, _ in self.failures}
        self._among = set(executor.workers()) - failed if failed else set()
        words = (self.job.strict, versions_here(), executor.name)
        self._sent = executor.send(computed_there, *words, among=self._among)
        self._sent.add_done_callback(self._done)

    def move_on(self) -> None:
        """Send it again if it is bound to workers that are all gone."""
        if not self._among or self._among & set(self.executor.workers()) or self.future.done():
            return
        left = self._sent
        self.send()
        left.release()

    def _done(self, sent: Any) -> None:
        """What has become of a try."""
        try:
            if sent is self._sent and not self.future.cancelled():
                # a result that is ready may still have to come through the scheduler
                with self.executor.gone_if_lost():
                    self._settle(sent)
        except InvalidStateError:
            # whoever wanted it has left meanwhile
            return
        except Exception as error:
            with suppress(InvalidStateError):
                self.future.set_exception(error)

    def _settle(self, sent: Any) -> None:
        starts = self.executor.starts(sent.key)
        if sent.status != "finished":
            self._lost(sent, starts)
            return
        found = sent.result()
        if isinstance(found, Outdated):
            raise outdated(found.worker, found.versions, versions_here())
        if not isinstance(found, Failed):
            self.future.set_result(found)
            return
        path = file_of(self.job)
        if found.view and path is not None and path.exists():
            # it came after all were asked, and other frames would fail there too
            raise blind("a worker", path, found.worker, found.view)
        self.failures.append((found.worker, found.error))
        self._try_again()

    def _lost(self, sent: Any, starts: int) -> None:
        """Its workers have died, so many of which had begun with it, or the scheduler has."""
        from distributed.scheduler import KilledWorker

        error = sent.exception() if sent.status == "error" else None
        if isinstance(error, KilledWorker):
            # those that had it but queued have not tried it
            worker = str(getattr(error.last_worker, "address", error.last_worker))
            died = ClusterError("the worker died: had it too little memory?")
            self.failures += [(worker, died)] * starts
            self._try_again()
        elif error is not None:
            if isinstance(error, ImportError):
                # it came after all were asked
                error = unloadable("a worker", error, versions_here()["scanfab"])
            self.failures.append(("a worker", error))
            self._try_again()
        else:
            raise self.executor.pulse.gone()

    def _try_again(self) -> None:
        if len(self.failures) < TRIES:
            self.send()
            return
        error = self.failures[-1][1]
        places = ", ".join(dict.fromkeys(place for place, _ in self.failures))
        text = f"{error} (tried {len(self.failures)} times, on {places})"
        known = type(error) if isinstance(error, ScanfabError) else ClusterError
        with suppress(TypeError):
            error = known(text)
        self.future.set_result(self.job.given_up(error))


class _Parts:
    """The scans of one frame, in parts that are done by workers; its solids are sent once."""

    def __init__(self, executor: DaskExecutor) -> None:
        self.executor = executor
        self._held: dict[str, Any] = {}

    def map(self, function: Callable[..., Any], parts: Sequence[Any]) -> list[Any]:
        """What the function makes of each part, in their order."""
        with self.executor.gone_if_lost():
            for _ in range(TRIES):
                found = self._tried(Packed.of(function), parts)
                if found is not None:
                    return found
                # the workers that held the solids have died
                self._held.clear()
        raise ClusterError(
            f"{self.executor.address}: the workers died again and again while one frame was "
            f"scanned: have they too little memory?"
        )

    def _tried(self, packed: Packed, parts: Sequence[Any]) -> list[Any] | None:
        held = {name: self._sent(name, what) for name, what in packed.heavy.items()}
        sent = [self.executor.send(scanned_there, packed.light, held, part) for part in parts]
        found = []
        for one in sent:
            error = one.exception()
            if error is None:
                found.append(one.result())
            elif isinstance(error, ScanfabError):
                raise error
            elif self.executor.client.status != "running":
                raise self.executor.pulse.gone()
            else:
                return None
        return found

    def _sent(self, name: str, what: Any) -> Any:
        if name not in self._held:
            scatter = self.executor.client.scatter
            self._held[name] = what, scatter(what, broadcast=True, hash=False)
        return self._held[name][1]
