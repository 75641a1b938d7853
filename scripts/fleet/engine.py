# SPDX-License-Identifier: BSD-3-Clause
"""Runs tasks on Dask: a cluster in this machine, or one that is there. A bounded number of them is on its way at a time.

One event loop holds client and, of an embedded cluster, the scheduler. A task on its way costs 13 ms of processor, so
that short records travel together. Workers are processes, so that one of them may die.
"""
import asyncio
import logging
import os
import signal
import sys
import tempfile

from . import task
from .errors import INTERRUPTED, FleetError, internal, missing, usage

_KILLED = object()   # in place of a row
_PER_CORE = 8        # groups on their way per core: none waits for the client
_GROUP, _MOST = 0.5, 16  # s, records: what a group takes, and how many it has at most
_CONNECT, _WORKERS = 10, 60  # s: until a scheduler answers, until it has a worker


def _distributed():
    try:
        import dask
        import distributed
    except ImportError as error:
        raise internal("%s (Debian: python3-distributed)" % error) from None
    dask.config.set({
        "distributed.scheduler.allowed-failures": 3,      # workers that a record may take with it
        "distributed.scheduler.worker-saturation": "inf",  # the client bounds what is on its way
        "distributed.scheduler.transition-log-length": 1000,
        "distributed.scheduler.events-log-length": 1000,
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.system-monitor.interval": "5s",
    })
    return distributed


def _by_value(function):
    """A copy that is no longer that of its module, so that pickle, which Dask tries first, refuses it and cloudpickle
    sends it whole: workers elsewhere, and since Dask 2024 schedulers, need none of these files."""
    import cloudpickle
    cloudpickle.register_pickle_by_value(task)
    return cloudpickle.loads(cloudpickle.dumps(function))


class Stopped(FleetError):
    def __init__(self):
        super().__init__(INTERRUPTED, "stopped; what is done is kept, the same command goes on from there")


class Engine:
    """`async with Engine(address) as engine`; without an address a cluster of all cores of this machine."""

    def __init__(self, address, cores=None):
        self._address, self._cores = address, cores
        self._distributed = _distributed()
        self._run_all = _by_value(task.run_all)
        self._cluster = self._client = None
        self._futures = {}
        self._size = 1  # records of a group
        self._stop = asyncio.Event()

    async def __aenter__(self):
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            loop.add_signal_handler(number, self._stop.set)
        try:
            await (self._connect() if self._address else self._start())
        except BaseException:
            await self.__aexit__(None, None, None)
            raise
        return self

    async def _start(self):
        cores = self._cores or len(os.sched_getaffinity(0))
        self._folder = tempfile.TemporaryDirectory(prefix="fleet_report_", ignore_cleanup_errors=True)
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        # Certificates of this run alone: no other user of the machine can hand tasks to it.
        self._cluster = await self._distributed.LocalCluster(
            n_workers=cores, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0,
            host="127.0.0.1", security=True, local_directory=self._folder.name, silence_logs=logging.CRITICAL,
            asynchronous=True)
        self._client = await self._distributed.Client(self._cluster, asynchronous=True)
        self.cores = cores

    async def _connect(self):
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            self._client = await self._distributed.Client(self._address, asynchronous=True, timeout=_CONNECT)
        except (OSError, asyncio.TimeoutError) as error:
            raise missing("--scheduler %s: does not answer: %s" % (self._address, error or "no answer")) from None
        except ValueError as error:
            raise usage("--scheduler %s: %s" % (self._address, error)) from None
        try:
            await self._client.wait_for_workers(1, timeout=_WORKERS)
        except (asyncio.TimeoutError, TimeoutError):
            raise missing("--scheduler %s: has no worker after %d s" % (self._address, _WORKERS)) from None
        workers = (await self._client.scheduler.identity())["workers"].values()
        self.cores = sum(worker["nthreads"] for worker in workers)

    async def __aexit__(self, *_):
        for part in (self._client, self._cluster):
            if part is not None:
                await asyncio.wait({asyncio.ensure_future(part.close())}, timeout=20)
        if self._cluster is not None:
            self._folder.cleanup()

    async def run(self, source, take):
        """Runs what `source(count)` gives (a list of tasks with a "key", awaited; empty: no more), and awaits
        `take(pairs)` of each group of (task, row) that ended. Throws Stopped on Ctrl-C and where it is ended.

        A worker that dies takes what waited on it with it, and Dask blames all of that. Tasks that it gives up are
        therefore tried once more at the end, each alone: then it is known whose fault it was."""
        most = max(32, _PER_CORE * self.cores)
        ended, flying, suspects, dry = asyncio.Queue(), {}, [], False
        stop = asyncio.ensure_future(self._stop.wait())
        try:
            while True:
                if self._stop.is_set():
                    raise Stopped()
                while not dry and len(flying) <= most // 2:
                    tasks = await source((most - len(flying)) * self._size)
                    dry = not tasks
                    self._submit([tasks[i:i + self._size] for i in range(0, len(tasks), self._size)], flying, ended)
                if not flying:
                    if not suspects:
                        return
                    self._submit([[dict(suspects.pop(), alone=True)]], flying, ended)
                done = []
                for key, rows in await self._next(ended, stop):
                    group = flying.pop(key)
                    if rows is _KILLED and not group[0].get("alone"):
                        suspects += group
                    else:
                        done += self._with_rows(group, rows)
                await take(done)
                self._resize([row for _, row in done])
        finally:
            stop.cancel()
            if flying:
                await self._client.cancel(list(self._futures.values()), force=True)

    def _resize(self, rows):
        """So many records to a group that it takes about _GROUP s."""
        seconds = [row["seconds"] for row in rows if row.get("seconds")]
        if seconds:
            self._size = max(1, min(_MOST, round(_GROUP * len(seconds) / sum(seconds))))

    def _submit(self, groups, flying, ended):
        if not groups:
            return
        keys = ["%s-%s" % ("alone" if group[0].get("alone") else "records", group[0]["key"]) for group in groups]
        futures = self._client.map(self._run_all, groups, key=keys, pure=False, retries=0)
        for key, group, future in zip(keys, groups, futures):
            flying[key] = group
            self._futures[key] = future
            asyncio.ensure_future(self._watch(key, future, ended))

    async def _watch(self, key, future, ended):
        await ended.put((key, future, await _outcome(future)))

    async def _next(self, ended, stop):
        """The groups that ended, at least one; none where the run shall stop."""
        first = asyncio.ensure_future(ended.get())
        await asyncio.wait({first, stop}, return_when=asyncio.FIRST_COMPLETED)
        if not first.done():
            first.cancel()
            raise Stopped()
        several = [first.result()]
        while not ended.empty():
            several.append(ended.get_nowait())
        for key, future, _ in several:
            del self._futures[key]
            future.release()  # the scheduler forgets it
        return [(key, self._rows(*outcome)) for key, _, outcome in several]

    @staticmethod
    def _with_rows(group, rows):
        """Each task with its row."""
        if isinstance(rows, list):
            return list(zip(group, rows))
        reason = "the worker died, each time that it was tried" if rows is _KILLED else rows
        return [(one, {"key": one["key"], "status": "crashed", "reason": reason}) for one in group]

    @staticmethod
    def _rows(status, result):
        """Those of a group, _KILLED, or why there are none."""
        if status == "finished":
            return result
        if status == "error" and type(result).__name__ == "KilledWorker":
            return _KILLED
        if status == "error":
            return "%s: %s" % (type(result).__name__, result)
        raise internal("lost the scheduler; what is done is kept, the same command goes on from there")


async def _outcome(future):
    """Status and row, or status and error."""
    try:
        return "finished", await future
    except asyncio.CancelledError:
        return "cancelled", None
    except Exception as error:  # noqa: BLE001 whatever a worker sends back is reported
        return future.status, error


def run(main):
    """`main` is a coroutine; its tracebacks are those of this package, not of a loop that closes."""
    try:
        return asyncio.run(main)
    finally:
        sys.stderr.flush()
