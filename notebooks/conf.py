"""How the book is made of this folder; `pages.py` writes what the code itself knows."""

import importlib
import pkgutil
import re
import sys
from pathlib import Path

from docutils.nodes import SkipNode
from latex2mathml.converter import convert

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]  # the package and its derivations, installed or not

import pages  # noqa: E402
import shown  # noqa: E402

import exactcreep  # noqa: E402
from exactcreep.figures.style import STYLE  # noqa: E402

project = "exactcreep"
author = "exactcreep"
version = release = exactcreep.__version__
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
    "sphinx_design",
    "matplotlib.sphinxext.plot_directive",
]
exclude_patterns = ["pictures/*.md", "_build", "reference/api"]
default_role = "py:obj"
highlight_language = "python"

# notebooks keep their outputs; `-D nb_execution_mode=force` computes them again
nb_execution_mode = "off"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
myst_enable_extensions = ["dollarmath", "amsmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
nb_render_markdown_format = "myst"  # formulas in what a notebook puts out
nb_merge_streams = True  # what a cell prints stands in one box
smartquotes = False  # --flags stay flags

autodoc_typehints = "none"  # numpydoc says the types
autodoc_member_order = "bysource"
autodoc_default_options = {"no-value": True}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
numpydoc_show_class_members = False
plot_html_show_source_link = False
plot_html_show_formats = False
plot_formats = [("png", 110)]
plot_rcparams = dict(STYLE)
plot_apply_rcparams = True  # drawings have the style of every other picture

toc_object_entries_show_parents = "hide"
html_theme = "pydata_sphinx_theme"
html_title = "exactcreep"
shown.MADE.mkdir(exist_ok=True)
html_static_path = ["_static"]
html_css_files = ["book.css"]
html_js_files = ["book.js"]
html_show_sourcelink = False
html_use_index = False
html_sidebars = {page: [] for page in ("install", "gallery", "contributing")}
html_math_renderer = "mathml"
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "show_prev_next": True,
    "footer_end": [],
}


def _math(translator, node):
    """Write a formula as MathML, which browsers draw without a program from elsewhere."""
    block = node.tagname == "math_block"
    text = convert(pages.plain_latex(node.astext()), display="block" if block else "inline")
    text = re.sub(r"<mi>(\w{2,})</mi>", r'<mspace width="0.17em"/><mi>\1</mi><mspace width="0.17em"/>', text)
    # a bar is no bracket to a browser: the first of two would grow, the second stand apart
    bar = '<mo stretchy="false" lspace="0" rspace="0">&#x0007C;</mo>'
    text = re.sub('<mo(?: stretchy="false")?>&#x0007C;</mo>', bar, text)
    # word joiners keep a bracket before a formula, and a full stop behind it, on its line
    said = node.parent.children[: node.parent.index(node)]
    opened = "&#8288;" if said and said[-1].astext().endswith("(") else ""
    translator.body.append(f'<div class="formula">{text}</div>' if block else f"{opened}{text}&#8288;")
    raise SkipNode


def _read(app, name, content):
    content[0] = shown.shown(pages.filled(content[0]), name)


def _skipped(app, what, name, value, skip, options):
    """Leave out what Python writes below the fields of a named tuple."""
    return True if (getattr(value, "__doc__", "") or "").startswith("Alias for field") else None


def _named(app, env, node, contnode):
    """Let the name of a parameter, or of what exists without a page, stand as it is written.

    What begins with the name of the package has to exist.
    """
    target = node["reftarget"]
    if node["reftype"] != "obj":
        return None
    domain = env.get_domain("py")
    for name in (f"exactcreep.{target}", f"exactcreep.results.{target}"):
        if name in domain.objects:  # named on a page of the other module
            return domain.resolve_xref(env, node["refdoc"], app.builder, "obj", name, node, contnode)
    if target.startswith("exactcreep.") and not _needs_an_extra(target):
        pkgutil.resolve_name(target)
    return contnode


def _needs_an_extra(name):
    """Tell whether the module of a name cannot be imported because another package is missing."""
    try:
        importlib.import_module(name)
    except ImportError as error:
        return not (error.name or "").startswith("exactcreep")
    return False


def setup(app):
    app.add_html_math_renderer(
        "mathml", inline_renderers=(_math, None), block_renderers=(_math, None)
    )
    app.connect("source-read", _read)
    app.connect("missing-reference", _named)
    app.connect("autodoc-skip-member", _skipped)
    app.connect("autodoc-process-docstring", pages.readable, priority=100)
