"""Growth of planning time as JSON, a Markdown table and a plot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from pydantic import TypeAdapter

from rbprm_core.bench.plots import write_figure
from rbprm_core.bench.scaling import PHASES, PROCESSOR, Growth
from rbprm_core.bench.tables import table
from rbprm_core.errors import InvalidInput
from rbprm_core.view.palette import INK, LIMBS


def write_growth(growth: Growth, folder: str | Path) -> tuple[Path, ...]:
    """Write a growth into a folder.

    Args:
        growth: planning times for several sizes.
        folder: path of the folder, which is made where it does not exist.

    Returns:
        The files written.

    Raises:
        InvalidInput: the folder cannot be made or written to.
    """
    folder = Path(folder)
    data, text, plot = (folder / f"growth_{growth.name}.{kind}" for kind in ("json", "md", "png"))
    content = TypeAdapter(Growth).dump_python(growth, mode="json")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        data.write_text(json.dumps(content, indent=1) + "\n")
        text.write_text(growth_table(growth) + "\n")
        write_figure(plot, 4.5, lambda ax: _draw(ax, growth))
    except OSError as error:
        reason = f"cannot be written to: {error.strerror}"
        raise InvalidInput("out", str(folder), reason) from error
    return data, text, plot


def growth_table(growth: Growth) -> str:
    """A Markdown table with one row for each size, then the exponents of the power laws.

    Args:
        growth: planning times for several sizes.
    """
    phases = (*PHASES, "total", PROCESSOR)
    head = (growth.unit, "surfaces in all", "success", *(f"{phase} [s]" for phase in phases))
    rows = [
        (
            f"{size.size:g}",
            str(size.surfaces),
            f"{size.successes} of {len(size.records)}",
            *(f"{size.seconds(phase):.3f}" for phase in phases),
            f"{size.reading:.2f}",
        )
        for size in growth.sizes
    ]
    fits = (
        ("exponent", "", "", *(f"{growth.exponent(phase):.2f}" for phase in phases), ""),
        (
            "exponent at the end", "", "",
            *(f"{growth.last_exponent(phase):.2f}" for phase in phases), "",
        ),
    )  # fmt: skip
    return table((*head, "reading [s]"), [*rows, *fits])


def _draw(ax: Axes, growth: Growth) -> None:
    """Draw processor time and phases over size, both axes logarithmic, linear growth dashed."""
    x = np.array([size.size for size in growth.sizes])
    for phase, color in zip(PHASES, LIMBS, strict=False):
        ax.plot(x, [size.seconds(phase) for size in growth.sizes], ".-", color=color, label=phase)
    times = np.array([size.seconds(PROCESSOR) for size in growth.sizes])
    label = f"processor time, exponent {growth.exponent():.2f}"
    ax.plot(x, times, "o-", color=INK, linewidth=2, label=label)
    ax.plot(x, times[0] * x / x[0], "--", color=INK, alpha=0.4, label="linear growth")
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("length of the path [m]" if growth.name == "length" else "surfaces around it")
    ax.set_ylabel("median time [s] (phases: elapsed time)")
    ax.grid(alpha=0.3)
    ax.legend(fontsize="small")
