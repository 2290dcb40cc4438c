"""How Sphinx builds these pages: MyST Markdown, docstrings in numpy style, the theme furo."""

from __future__ import annotations

import re
from importlib.metadata import version as version_of

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.inspect import TypeAliasForwardRef
from typer.main import get_command

from hertzchain.cli.commands import app

project = "hertzchain"
author = "The hertzchain developers"
project_copyright = author
version = release = version_of("hertzchain")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "hertzchain"
html_show_sourcelink = False
html_copy_source = False

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "FloatArray")}
TypeAliasForwardRef.__repr__ = lambda self: self.name  # in unions
maximum_signature_line_length = 80
python_use_unqualified_type_names = True
napoleon_google_docstring = False


class Commands(SphinxDirective):
    """Every command with its options, as ``--help`` has them."""

    def run(self) -> list[nodes.Node]:
        """One section for each."""
        group = get_command(app)
        sections: list[nodes.Node] = []
        for name, command in group.commands.items():
            context = command.context_class(command, info_name=f"hertzchain {name}")
            section = nodes.section("", nodes.title("", name), ids=[name], names=[name])
            usage = command.get_usage(context)
            section += nodes.literal_block(usage, usage)
            section += [nodes.paragraph("", text) for text in command.help.split("\n\n")]
            entries = nodes.definition_list()
            for parameter in command.get_params(context):
                term, meaning = parameter.get_help_record(context)
                # As code, or two hyphens become a dash.
                parts = (
                    nodes.literal("", part) if part.startswith("-") else nodes.Text(part)
                    for part in re.split(r"(--[a-z-]+)", meaning)
                )
                definition = nodes.definition("", nodes.paragraph("", "", *parts))
                entries += nodes.definition_list_item(
                    "", nodes.term("", "", nodes.literal("", term)), definition
                )
            section += entries
            self.state.document.note_explicit_target(section)
            sections.append(section)
        return sections


def setup(sphinx: Sphinx) -> dict[str, bool]:
    """Tell Sphinx of the directive."""
    sphinx.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
