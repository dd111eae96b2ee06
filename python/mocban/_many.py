"""Alignment of many pairs with bounded memory."""

from __future__ import annotations

import os
import threading
from collections.abc import Hashable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from ._alignment import Alignment, align, metric_names
from ._errors import Error, InputError
from ._inputs import Mesh, Print
from ._settings import Settings, settings_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Key = TypeVar("Key", bound=Hashable)

#: Estimate of the memory that a pair in process needs for each byte of its files.
_BYTES_PER_FILE_BYTE = 12
#: Estimate of the memory that a pair in process needs besides.
_BYTES_PER_PAIR = 40_000_000


def align_many(
    pairs: Iterable[tuple[Key, Mesh | str | os.PathLike[str], Print | str | os.PathLike[str] | ArrayLike]],
    *,
    threads: int | None = None,
    max_bytes: int | None = None,
    metrics: Iterable[str] | None = None,
    settings: Settings | str | None = None,
) -> Iterator[tuple[Key, Alignment | Error]]:
    """Align pairs on several threads, and yield results in the order of the pairs.

    Pairs are taken from the iterable when they are needed, and at most two for each thread are in memory. Threads run
    only while the iterator is in use; closing it ends them.

    Parameters
    ----------
    pairs : iterable of (key, mesh, print)
        The key comes back with the result. Meshes and prints are those of `align`; paths are read on the threads.
    threads : int, optional
        Number of pairs in process at the same time; the number of processors by default.
    max_bytes : int, optional
        Approximate limit of the memory of all pairs in process; a pair that needs more is aligned alone.
    metrics, settings
        Those of `align`.

    Yields
    ------
    (key, Alignment or Error)
        A pair that cannot be aligned because of its inputs gives its exception and does not end the iteration. Other
        exceptions do; that of ``pairs`` comes after the results of the pairs before it.

    Examples
    --------
    >>> import mocban
    >>> for key, found in mocban.align_many([("a", "pair.stl", "pair.png"), ("b", "no.stl", "pair.png")], threads=2):
    ...     print(key, found.code if isinstance(found, mocban.Error) else found.status)
    a aligned
    b not_found
    """
    for name, number in (("threads", threads), ("max_bytes", max_bytes)):
        if number is not None and not (isinstance(number, int) and number >= 1):
            raise InputError(f"{name} is {number!r}; give a whole number of at least 1", "usage")
    count = (os.cpu_count() or 1) if threads is None else threads
    chosen = settings_of(settings)
    names = None if metrics is None else metric_names(metrics, chosen)
    return _results(iter(pairs), count, max_bytes, {"metrics": names, "settings": chosen})


class _Work:
    """One pair: its inputs until it is aligned, then its result."""

    __slots__ = ("key", "mesh", "image", "bytes", "done", "result", "failure")

    def __init__(self, key: Any, mesh: Any, image: Any) -> None:
        self.key = key
        self.mesh: Any = mesh
        self.image: Any = image
        self.bytes = _BYTES_PER_PAIR + _BYTES_PER_FILE_BYTE * (_size(mesh) + _size(image))
        self.done = threading.Event()
        self.result: Alignment | Error | None = None
        self.failure: BaseException | None = None

    def run(self, options: dict[str, Any]) -> None:
        try:
            self.result = align(self.mesh, self.image, **options)
        except Error as error:
            self.result = error
        except BaseException as failure:  # raised again by the thread that iterates
            self.failure = failure
        finally:
            self.mesh = self.image = None
            self.done.set()


def _next(pairs: Iterator[Any]) -> _Work | None:
    """Return the next pair; None if there is none."""
    for taken in pairs:
        if isinstance(taken, (tuple, list)) and len(taken) == 3:
            return _Work(*taken)
        raise InputError(f"a pair is {taken!r:.80}; give (key, mesh, print)", "usage")
    return None


def _size(value: Any) -> int:
    if isinstance(value, (str, os.PathLike)):
        try:
            return os.stat(value).st_size
        except OSError:
            return 0
    if isinstance(value, Mesh):
        vertices, faces = value._native.counts()
        return 24 * vertices + 12 * faces
    if isinstance(value, Print):
        width, height = value.size
        return 6 * width * height
    return int(getattr(value, "nbytes", 0))


def _results(
    pairs: Iterator[Any], threads: int, max_bytes: int | None, options: dict[str, Any]
) -> Iterator[tuple[Any, Alignment | Error]]:
    import queue

    todo: queue.SimpleQueue[_Work | None] = queue.SimpleQueue()

    def worker() -> None:
        while (work := todo.get()) is not None:
            if not stopped:
                work.run(options)

    stopped = False
    pool: list[threading.Thread] = []
    waiting: list[_Work] = []
    held: _Work | None = None
    failure: Exception | None = None
    more = True
    try:
        while True:
            while more and len(waiting) < 2 * threads:
                if held is None:
                    try:
                        held = _next(pairs)
                    except Exception as error:  # raised again after the results of the pairs before it
                        failure = error
                    if held is None:
                        more = False
                        break
                in_process = sum(work.bytes for work in waiting if not work.done.is_set())
                if max_bytes is not None and in_process and in_process + held.bytes > max_bytes:
                    break
                if len(pool) < threads:
                    pool.append(threading.Thread(target=worker, name="mocban align_many", daemon=True))
                    pool[-1].start()
                waiting.append(held)
                todo.put(held)
                held = None
            if not waiting:
                if failure is not None:
                    raise failure
                return
            first = waiting.pop(0)
            # A wait without a limit would not notice Ctrl-C on every system.
            while not first.done.wait(0.1):
                pass
            if first.failure is not None:
                raise first.failure
            assert first.result is not None
            yield first.key, first.result
    finally:
        stopped = True
        for _ in pool:
            todo.put(None)
