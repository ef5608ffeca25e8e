"""Pages of the API: the public names of rbprm_core, a page for each of its packages, one for its
single modules, one for the client of the node.

The pages are written into docs/api before the build, from the modules that there are.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections import defaultdict
from pathlib import Path

from sphinx.application import Sphinx

PACKAGE = "rbprm_core"
CLIENT = ["rbprm_ros.client.planner_client", "rbprm_ros.client.plan_call"]
COMMANDS = f"{PACKAGE}.cli"  # the command line has its help


def modules() -> dict[str, list[str]]:
    """The public modules by page: the package of the first level that they are in."""
    package = importlib.import_module(PACKAGE)
    pages: dict[str, list[str]] = defaultdict(list)
    for found in pkgutil.walk_packages(package.__path__, f"{PACKAGE}."):
        parts = found.name.split(".")
        if found.name.startswith(COMMANDS) or any(part.startswith("_") for part in parts):
            continue
        single = len(parts) == 2 and not found.ispkg
        pages["modules" if single else parts[1]].append(found.name)
    return pages


def page(title: str, names: list[str]) -> str:
    """The text of a page with one section for each module."""
    text = [title, "=" * len(title), ""]
    for name in sorted(names):
        text += [name, "-" * len(name), "", f".. automodule:: {name}"]
        text += ["   :members:", "   :show-inheritance:", "   :ignore-module-all:", ""]
    return "\n".join(text)


def public_page() -> str:
    """The text of the page with the names in `rbprm_core.__all__`."""
    title = f"{PACKAGE}: public names"
    options = ["   :members:", "   :imported-members:", "   :no-index:", ""]
    return "\n".join([title, "=" * len(title), "", f".. automodule:: {PACKAGE}", *options])


def _write(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "api"
    folder.mkdir(exist_ok=True)
    pages = {
        f"{name}.rst": page(f"{PACKAGE}.{name}" if name != "modules" else "Single modules", found)
        for name, found in modules().items()
    }
    pages["client.rst"] = page("rbprm_ros.client", CLIENT)
    names = [f"   {Path(name).stem}" for name in sorted(pages)]
    pages[f"{PACKAGE}.rst"] = public_page()
    entries = "\n".join([f"   {PACKAGE}", *names])
    pages["index.rst"] = f"API\n===\n\n.. toctree::\n\n{entries}\n"
    for stale in folder.glob("*.rst"):
        if stale.name not in pages:
            stale.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
