"""Settings of Sphinx, by which ``scripts/docs`` makes the site; its sources are the repository.

Only the messages that catkin generates are replaced by mocks, so that the site needs no build.
"""

from __future__ import annotations

import gc
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
# Before those of a workspace that the caller has sourced.
sys.path[:0] = [str(HERE), *map(str, sorted(ROOT.glob("*/src")))]

gc.set_threshold(100_000, 20, 20)  # a tree of a page has many nodes, and all stay until its end

project = "ROSoClingo"
html_title = "ROSoClingo"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.graphviz",
    "api_pages",
    "docstrings",
    "one_site",
]

root_doc = "README"
include_patterns = [
    "README.md", "CONTRIBUTING.md", "docs/*.md", "docs/api/*.rst", "*/README.md", "test/bags/README.md",
    "*/CHANGELOG.rst",
]  # fmt: skip
exclude_patterns = [".*", "build", "demo", "devel", "install", "site"]

myst_heading_anchors = 6
myst_fence_as_directive = ["mermaid"]
highlight_language = "text"
smartquotes_action = "D"  # dashes alone; quotation marks are those of the code

autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_mock_imports = [
    "rosclingo.msg", "rosclingo.srv", "rosoclingo.msg", "rosoclingo.srv", "rosoclingo_simulator.srv",
]  # fmt: skip
autodoc_typehints_format = "short"
add_module_names = False
python_use_unqualified_type_names = True

# Names of this repository have to lead somewhere. Those of others would need their sites; private
# names and variables of types stand in signatures, and have no description.
nitpicky = True
nitpick_ignore_regex = [
    (
        "py:.*",
        r"(abc|actionlib|actionlib_msgs|aiohttp|argparse|asyncio|clingo|concurrent|_?contextvars|enum"
        r"|fractions|geometry_msgs|matplotlib|nav_msgs|numpy|pathlib|random|rospy|sensor_msgs|socket|threading"
        r"|subprocess|visualization_msgs|yaml)\..*",
    ),
    ("py:.*", r"ros.*\.(_\w+|T)"),
    ("py:class", r"WhyAnswer"),  # which is imported for checks of types only
    ("py:class", r"long long|void"),  # what is said of compiled functions
]

graphviz_output_format = "svg"

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
