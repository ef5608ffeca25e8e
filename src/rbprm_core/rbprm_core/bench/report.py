"""Files of a campaign: JSON, tables and plots in a folder."""

from __future__ import annotations

import json
from pathlib import Path

from rbprm_core.bench.campaign import Campaign
from rbprm_core.bench.tables import markdown
from rbprm_core.errors import InvalidInput


def write_campaign(campaign: Campaign, folder: str | Path) -> tuple[Path, ...]:
    """Write a campaign into a folder: JSON first, then tables and plots.

    Args:
        campaign: the campaign.
        folder: path of the folder, which is made where it does not exist.

    Returns:
        The files written.

    Raises:
        InvalidInput: the folder cannot be made or written to.
    """
    from rbprm_core.bench.plots import write_plots  # matplotlib takes a second

    folder = Path(folder)
    data, tables = folder / "campaign.json", folder / "campaign.md"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        data.write_text(json.dumps(campaign.content(), indent=1) + "\n")
        tables.write_text(markdown(campaign))
        plots = write_plots(campaign, folder) if campaign.records else ()
    except OSError as error:
        reason = f"cannot be written to: {error.strerror}"
        raise InvalidInput("out", str(folder), reason) from error
    return (data, tables, *plots)
