"""How the pages of this folder become a site: `sphinx-build -W docs build/site`, from the root.

Nothing is fetched, neither while it is made nor while it is read: no web fonts, no scripts from
elsewhere, no inventories of other projects. Warnings are errors in `.ci/run`.
"""

import re
from importlib.metadata import version as version_of

project = "flintknap"
author = "the flintknap authors"
copyright = author
version = release = version_of("flintknap")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
default_role = "py:obj"

autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
napoleon_custom_sections = [("Attributes", "params_style")]
highlight_language = "none"
autodoc_type_aliases = {"ArrayLike": "ArrayLike"}
autodoc_preserve_defaults = True
add_module_names = False
python_use_unqualified_type_names = True
maximum_signature_line_length = 72

myst_heading_anchors = 3

html_theme = "furo"
html_title = f"flintknap {version}"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
pygments_style, pygments_dark_style = "friendly", "github-dark"


def setup(app):
    """Let types stand as they are written."""
    app.connect("autodoc-process-signature", _with_short_types)


def _with_short_types(*about):
    arguments, result = about[-2:]
    return arguments and _short(arguments), result and _short(result)


def _short(types):
    types = re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", types)
    return re.sub(
        r"~numpy\.ndarray\[[^.]*\.Any, \.{3}\], ~numpy\.dtype\[~(.*?)\]\]", r"NDArray[\1]", types
    )
