"""Settings of the documentation; `make docs` builds it into docs/_build/html."""

from __future__ import annotations

import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
SOURCES = [str(ROOT / "src" / name) for name in ("rbprm_core", "rbprm_ros")]
sys.path[:0] = [str(DOCS / "_extensions"), *SOURCES]

project = "rbprm"
author = "rbprm contributors"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "api_pages",
    "interface_files",
    "markdown_docstrings",
    "mathml",
]

# Pages
exclude_patterns = ["_build", "_extensions"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "rbprm"
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False
pygments_style = "default"

# API pages
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_type_aliases = {"Array": "Array"}
autodoc_mock_imports = ["rclpy", "rbprm_msgs"]  # the client's page needs no ROS
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
python_maximum_signature_line_length = 88
