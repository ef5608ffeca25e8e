"""A benchmark campaign on the workers of a Dask cluster, here two processes of this machine.

For the machines of a network, use the address of their scheduler: `Client("tcp://host:8786")` in
place of the local cluster, or `rbprm bench SCENARIO --backend dask --scheduler tcp://host:8786`.
Each worker needs this package, and has one thread, since it serves one run at a time.

Run it by `.venv/bin/python examples/bench_on_dask.py [SCENARIO...] [--seeds N] [--out FOLDER]`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from distributed import Client, LocalCluster
from rich.console import Console

from rbprm_core.bench import Case, run_campaign, write_campaign
from rbprm_core.bench.tables import overview_table


def main() -> None:
    """Run the campaign, print the process of each run, and write its files into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenarios", nargs="*", default=["flat"], help="known names or files")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--out", type=Path, default=Path("bench_output/dask"))
    arguments = parser.parse_args()
    console = Console(highlight=False, soft_wrap=True)
    cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, Client(cluster) as client:
        workers = client.scheduler_info()["workers"]
        console.print(f"{len(workers)} workers: {', '.join(workers)}")
        campaign = run_campaign(
            [Case(name) for name in arguments.scenarios],
            range(arguments.seeds),
            backend="dask",
            on_record=lambda run: console.print(
                f"{run.scenario}, seed {run.seed}: {run.wall:.2f} s on process {run.process}"
            ),
        )
    console.print(overview_table(campaign.aggregates), markup=False)
    for path in write_campaign(campaign, arguments.out):
        console.print(f"written: {path}")


if __name__ == "__main__":
    main()
