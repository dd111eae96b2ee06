"""Alignment of many pairs with bounded memory."""

from __future__ import annotations

import os
import threading
from collections.abc import Hashable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, TypeVar

from . import _native as _rust
from ._alignment import Alignment, aligned, metric_names
from ._errors import Cancelled, Error, InputError
from ._inputs import Mesh, Print
from ._settings import Settings, settings_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Key = TypeVar("Key", bound=Hashable)


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
    only while the iterator is in use. Closing it, an exception and Ctrl-C stop the pairs in process and end the threads.

    Parameters
    ----------
    pairs : iterable of (key, mesh, print)
        The key comes back with the result. Meshes and prints are those of `align`; paths are read on the threads.
    threads : int, optional
        Number of pairs in process at the same time; by default the number of processors that this process may use.
    max_bytes : int, optional
        Approximate limit of the memory of all pairs in process, estimated like ``mocban run --memory`` from the sizes of
        meshes and prints, and of results that wait for their turn. A pair that needs more is aligned alone. What the caller
        keeps does not count.
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
    count = _rust.available_threads() if threads is None else threads
    chosen = settings_of(settings)
    names = None if metrics is None else metric_names(metrics, chosen)
    return _results(iter(pairs), count, max_bytes, names, chosen)


class _Work:
    """One pair: its inputs until it is aligned, then its result."""

    __slots__ = ("key", "mesh", "image", "estimate", "done", "result", "failure")

    def __init__(self, key: Any, mesh: Any, image: Any) -> None:
        self.key = key
        self.mesh: Any = mesh
        self.image: Any = image
        #: Memory that it needs while it is aligned, if there is a limit.
        self.estimate = 0
        self.done = threading.Event()
        self.result: Alignment | Error | None = None
        self.failure: BaseException | None = None

    def run(self, names: tuple[str, ...] | None, chosen: Settings, cancel: _rust.NativeCancel) -> None:
        try:
            self.result = aligned(self.mesh, self.image, names, chosen, cancel=cancel)
        except Cancelled as failure:  # of another pair, or of all
            self.failure = failure
        except Error as error:
            self.result = error
        except BaseException as failure:  # raised again by the thread that iterates
            self.failure = failure
        finally:
            self.mesh = self.image = None
            self.done.set()

    def take(self) -> Alignment | Error:
        """Return the result, and forget it."""
        result, self.result = self.result, None
        assert result is not None
        return result

    def held_bytes(self) -> int:
        """Return an estimate of the memory that the pair takes, or its result."""
        if not self.done.is_set():
            return self.estimate
        native = self.result._native if isinstance(self.result, Alignment) else None
        return 0 if native is None else native.held_bytes()


def _next(pairs: Iterator[Any]) -> _Work | None:
    """Return the next pair; None if there is none."""
    for taken in pairs:
        if isinstance(taken, (tuple, list)) and len(taken) == 3:
            return _Work(*taken)
        raise InputError(f"a pair is {taken!r:.80}; give (key, mesh, print)", "usage")
    return None


def _estimate(mesh: Any, image: Any, chosen: Settings) -> int:
    """Return an estimate of the memory that a pair needs while it is aligned, as a run of a project estimates it."""
    files = [os.fspath(one) if isinstance(one, (str, os.PathLike)) else None for one in (mesh, image)]
    counts = mesh._native.counts() if isinstance(mesh, Mesh) else (0, 0)
    # A path has no pixels; what is neither is refused when it is aligned.
    width, height = image.size if isinstance(image, Print) else _array_size(image)
    return _rust.pair_bytes(files[0], counts, files[1], width * height, chosen._native)


def _array_size(image: Any) -> tuple[int, int]:
    """Return width and height of an array, or of an image of PIL."""
    shape = getattr(image, "shape", None) or getattr(image, "size", None)
    if shape is None and isinstance(image, (list, tuple)) and image and isinstance(image[0], (list, tuple)):
        shape = (len(image), len(image[0]))
    if not isinstance(shape, tuple) or len(shape) < 2:
        return 0, 0
    return int(shape[0]), int(shape[1])


def _results(
    pairs: Iterator[Any], threads: int, max_bytes: int | None, names: tuple[str, ...] | None, chosen: Settings
) -> Iterator[tuple[Any, Alignment | Error]]:
    import queue

    todo: queue.SimpleQueue[_Work | None] = queue.SimpleQueue()

    def worker() -> None:
        while (work := todo.get()) is not None:
            if not stopped:
                work.run(names, chosen, cancel)

    stopped = False
    cancel = _rust.NativeCancel()
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
                        if held is not None and max_bytes is not None:
                            held.estimate = _estimate(held.mesh, held.image, chosen)
                    except Exception as error:  # raised again after the results of the pairs before it
                        held, failure = None, error
                    if held is None:
                        more = False
                        break
                if max_bytes is not None:
                    taken = sum(work.held_bytes() for work in waiting)
                    if taken and taken + held.estimate > max_bytes:
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
            # The caller decides how long the result stays in memory.
            yield first.key, first.take()
    finally:
        stopped = True
        cancel.cancel()
        for _ in pool:
            todo.put(None)
