"""Formulas as MathML, made while the pages are built.

Browsers draw MathML themselves, so that the pages need neither scripts nor another server. A
formula that cannot be converted is a warning, and warnings are errors in `make docs`.
"""

from __future__ import annotations

from typing import Any

from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

logger = logging.getLogger(__name__)


def _visit(translator: Any, node: Any, block: bool) -> None:
    """Write one formula and skip its children."""
    tex = node.astext()
    try:
        made = tex2mathml(tex, as_block=block)
    except MathError as error:
        logger.warning("formula %r: %s", tex, error, location=node)
        made = f"<code>{translator.encode(tex)}</code>"
    translator.body.append(f'<div class="math">{made}</div>' if block else made)
    raise SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_html_math_renderer(
        "mathml",
        inline_renderers=(lambda translator, node: _visit(translator, node, False), None),
        block_renderers=(lambda translator, node: _visit(translator, node, True), None),
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
