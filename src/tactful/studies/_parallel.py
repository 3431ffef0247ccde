"""Tasks on several processes of this machine, or on the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

from tactful.errors import TactfulError

Task = TypeVar("Task")
Result = TypeVar("Result")

_CONNECT_S = 10.0


@contextmanager
def connected(address: str | None) -> Iterator[Any]:
    """Yield a client of the scheduler at an address, or None without an address.

    Raises:
        TactfulError: if Dask is not installed, or nothing answers there.
    """
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise TactfulError('--scheduler needs Dask: pip install "tactful[studies]"') from None
    try:
        client = Client(address, timeout=_CONNECT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0]
        raise TactfulError(f"no Dask scheduler answers at {address!r}: {reason}") from None
    try:
        yield client
    finally:
        client.close()  # type: ignore[no-untyped-call]


def results(
    work: Callable[[Task], Result], tasks: Sequence[Task], *, jobs: int, client: Any = None
) -> Iterator[tuple[int, Result]]:
    """Yield the number of each task and what came of it, as they become complete."""
    if client is not None:
        from distributed import as_completed as as_gathered

        futures = {client.submit(work, task, pure=False): number for number, task in enumerate(tasks)}
        for future in as_gathered(futures):  # type: ignore[no-untyped-call]
            yield futures[future], future.result()
    elif jobs == 1 or len(tasks) <= 1:
        for number, task in enumerate(tasks):
            yield number, work(task)
    else:
        with ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(work, task): number for number, task in enumerate(tasks)}
            try:
                for done in as_completed(waiting):
                    yield waiting[done], done.result()
            finally:
                pool.shutdown(cancel_futures=True)
