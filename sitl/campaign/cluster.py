"""A campaign's runs on a Dask cluster: the same function of the same jobs, sent to whoever is there.

The cluster is found at its scheduler's address; distributed (extra ``cluster``) is loaded only here. A run whose worker dies
is done again by another. Workers must have this very program, so that the results are those of this computer.
"""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Iterator, Sequence
from typing import Any, Final

from companion.commands import MissingExtraError, install_line
from companion.settings import ConfigError

from .work import CampaignError, Job, RunRow, program, run_job

PATIENCE_S: Final = 10.0
"""For the scheduler to answer, and for a first worker."""


def over_cluster(jobs: Sequence[Job], address: str, patience_s: float | None = None) -> Iterator[RunRow]:
    """Do the runs on the cluster whose scheduler is at ``address`` (``tcp://host:8786``), and return rows as they come in.

    Raises MissingExtraError, ConfigError for what is no address, and CampaignError when the cluster is not there, has no
    workers or another program, or is lost.
    """
    if importlib.util.find_spec("distributed") is None:
        raise MissingExtraError(f"--cluster needs Dask: {install_line('cluster')}")
    from distributed import as_completed

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what is lost is said below, in one line
    patience_s = PATIENCE_S if patience_s is None else patience_s
    undone: list[str] = []
    with _connect(address, patience_s) as client:
        _same_program(client, address, patience_s)
        futures = client.map(run_job, jobs, pure=False)
        try:
            for future in as_completed(futures, loop=client.loop):
                if future.status == "finished":
                    yield future.result()
                else:
                    undone.append(_why(future))
        finally:
            client.cancel([future for future in futures if not future.done()])
    if undone:
        raise CampaignError(f"--cluster {address}: {len(undone)} runs are not done: {undone[0]}")


def _why(future: Any) -> str:
    """Why there is no result: the run broke its worker too often, or the cluster is gone."""
    error = future.exception() if future.status == "error" else None
    return "the cluster is gone" if error is None else f"{type(error).__name__}: {error}"


def _connect(address: str, patience_s: float) -> Any:
    from distributed import Client
    from distributed.comm.addressing import get_address_host_port

    try:
        get_address_host_port(address)
    except ValueError as error:
        raise ConfigError("--cluster", [f"{address}: write it as tcp://host:8786 ({error})"]) from None
    try:
        return Client(address, timeout=patience_s, set_as_default=False)
    except OSError as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise CampaignError(f"--cluster {address}: no Dask scheduler answers there ({reason})") from None


def _same_program(client: Any, address: str, patience_s: float) -> None:
    """Wait for a worker, and hold every worker's program against this one. Raises CampaignError."""
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except TimeoutError:
        raise CampaignError(
            f"--cluster {address}: no workers; start one with: dask worker {address} --nthreads 1"
        ) from None
    try:
        found = client.run(program)
    except ImportError as error:
        raise CampaignError(f"--cluster {address}: a worker lacks this program; install it there ({error})") from None
    others = sorted(worker for worker, name in found.items() if name != program())
    if others:
        raise CampaignError(
            f"--cluster {address}: another version of this program on {', '.join(others)}; install this one"
        )
