"""Settings of the documentation site, whose contents are in `index.md`.

    sphinx-build -c cases/site . build/site

The pages are README and the guides where they are, so no text exists twice. Neither the build nor a
reader loads anything from the network.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import click
from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx import addnodes

import tyrecal
from tyrecal.cli.main import COMMANDS, cli

sys.path.insert(0, str(Path(__file__).parent))
from reference import TABLES

ROOT = Path(__file__).parents[2]
# docutils has the index of a letter with a bar below the letter
BAR_OVER_INDEX = re.compile(
    r"<munderover>\s*(<mi>.*?</mi>)\s*(<m.>.*?</m.>)"
    r'\s*(<mo stretchy="false">.*?</mo>)\s*</munderover>'
)
NOTES = "tests/benchmarks/records/", "tests/benchmarks/blind/"

project, release, language = "tyrecal", tyrecal.__version__, "en"
root_doc = "cases/site/index"
include_patterns = [
    *("*.md", ".github/*.md", "cases/*.md", "cases/site/*", "solvers/*.md", "tests/*.md"),
    "tests/benchmarks/*.md",
]
exclude_patterns = [".venv*", "build"]
extensions = ["myst_parser", "sphinx_click", "sphinx_copybutton", "sphinx.ext.autodoc"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
smartquotes = False  # or -- of options becomes a dash
default_role = "literal"
autodoc_member_order = "bysource"
html_domain_indices = False
html_theme = "furo"
html_title = f"tyrecal {release}"
html_math_renderer = "mathml"
html_extra_path = ["index.html"]
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_copyright = False
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"top_of_page_buttons": []}

for _name in COMMANDS:  # the functions are all named `command`
    cli.get_command(click.Context(cli), _name).name = _name


def formula(writer: Any, node: nodes.Element) -> None:
    """A formula as MathML, which browsers show without a script."""
    is_block = isinstance(node, nodes.math_block)
    mathml = latex2mathml.tex2mathml(node.astext(), as_block=is_block)
    writer.body.append(BAR_OVER_INDEX.sub(r"<msub><mover>\1\3</mover>\2</msub>", mathml))
    raise nodes.SkipNode


def words_alone(app: Any, tree: nodes.document) -> None:
    """Keep the words of links to the repository's folders and laboratory notes, which are no
    pages."""
    for link in list(tree.findall(addnodes.pending_xref)):
        target = ROOT / Path(link.get("refdoc", "")).parent / str(link["reftarget"])
        if target.is_dir() or str(link["reftarget"]).startswith(NOTES):
            link.replace_self(link.children)


def with_tables(app: Any, name: str, source: list[str]) -> None:
    """Put the tables of `reference` where the page has `[[NAME]]`."""
    if name.startswith("cases/site/"):
        source[0] = re.sub(r"\[\[([\w ]+)\]\]", lambda match: TABLES[match[1]](), source[0])


def help_text(app: Any, context: click.Context, lines: list[str]) -> None:
    """The help of a command: examples as code, no letter with a meaning in RST."""
    text = "\n".join(lines).replace("*", r"\*")
    example = r"(?m)(?:^\| .*\n?)+"
    code = lambda match: "::\n\n" + re.sub(r"(?m)^\| ", "   ", match[0]).replace("\\*", "*") + "\n"
    lines[:] = [*re.sub(example, code, text).splitlines(), ""]


def no_text(app: Any, context: click.Context, lines: list[str]) -> None:
    """Environment variables are in the help of their options."""
    lines.clear()


def no_signature(app: Any, what: str, *rest: Any) -> tuple[str, None] | None:
    """What a class is made of is no part of the interface."""
    return ("", None) if what in ("class", "exception") else None


def setup(app: Any) -> None:
    """Register what Sphinx does not have."""
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    app.connect("source-read", with_tables)
    app.connect("doctree-read", words_alone)
    app.connect("autodoc-process-signature", no_signature)
    app.connect("sphinx-click-process-description", help_text)
    app.connect("sphinx-click-process-envvars", no_text)
