"""How Sphinx builds these pages: MyST Markdown, docstrings in numpy style, the theme furo."""

from __future__ import annotations

import html
import re
import sys
from collections.abc import Iterator
from importlib.metadata import version as version_of
from pathlib import Path
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.transforms.post_transforms import SphinxPostTransform
from sphinx.util.docutils import SphinxDirective
from sphinx.util.inspect import TypeAliasForwardRef
from sphinx.util.nodes import make_refnode
from sphinx.writers.html5 import HTML5Translator
from typer.main import get_command

from hertzchain.cli.commands import app

sys.path.insert(0, str(Path(__file__).parent))
from code_map import draw

project = "hertzchain"
author = "The hertzchain developers"
project_copyright = author
version = release = version_of("hertzchain")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build", "paper/paper.md"]  # the paper is for Pandoc, with its citations
myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
nb_execution_mode = "off"  # `make notebooks` runs them, and a test compares what they print

html_math_renderer = "mathml"
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
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
            records = (entry.get_help_record(context) for entry in command.get_params(context))
            for term, meaning in filter(None, records):  # None: an option that help hides
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


class CodeMap(SphinxDirective):
    """The map of the code, drawn from its imports."""

    def run(self) -> list[nodes.Node]:
        """One figure."""
        return [nodes.raw("", f'<div class="drawn">{draw()}</div>', format="html")]


class EquationLinks(SphinxPostTransform):
    """Every "Eq. 3" or "Eqs. 3, 6 and 9" in the text of a page links to the equations."""

    default_priority = 500  # chosen: after links and references are resolved

    _LIST = re.compile(r"Eqs?\.\s\d[ab]?(?:(?:, | and | to | or )\d[ab]?)*")
    _ONE = re.compile(r"(?:Eqs?\.\s)?(\d)[ab]?")
    _UNCHANGED = (nodes.reference, nodes.title, nodes.literal, nodes.literal_block, nodes.math)
    _PAGE = "physics"

    def run(self) -> None:
        """Replace the text of each mention."""
        for text in list(self.document.findall(nodes.Text)):
            if self._is_changed(text) and self._LIST.search(text):
                text.parent.replace(text, list(self._linked(str(text))))

    def _is_changed(self, text: nodes.Text) -> bool:
        node = text.parent
        while node is not None and not isinstance(node, self._UNCHANGED):
            node = node.parent
        return node is None

    def _linked(self, text: str) -> Iterator[nodes.Node]:
        end = 0
        for mentions in self._LIST.finditer(text):
            for entry in self._ONE.finditer(text, *mentions.span()):
                yield nodes.Text(text[end : entry.start()])
                target = f"eq-{entry[1]}"
                yield make_refnode(
                    self.app.builder, self.env.docname, self._PAGE, target, nodes.Text(entry[0])
                )
                end = entry.end()
        yield nodes.Text(text[end:])


_MATHML = "http://www.w3.org/1998/Math/MathML"
ElementTree.register_namespace("", _MATHML)
_ACCENTS = {
    "\N{DIAERESIS}",
    "\N{DOT ABOVE}",
    "\N{MODIFIER LETTER MACRON}",
    "\N{MODIFIER LETTER CIRCUMFLEX ACCENT}",
}
_NO_XML = re.compile(r"&(?!lt;|gt;|amp;|quot;)\w+;")
"""Entities that HTML has and XML does not."""


def write_math(translator: HTML5Translator, node: nodes.math | nodes.math_block) -> None:
    """Write a formula as MathML, which browsers typeset without a script or a network."""
    is_block = isinstance(node, nodes.math_block)
    text = tex2mathml(node.astext(), as_block=is_block)
    text = _NO_XML.sub(lambda entity: html.unescape(entity[0]), text)
    formula = ElementTree.fromstring(text)  # noqa: S314 - docutils wrote it
    for element in list(formula.iter()):
        _place_accent(element)
        _stretch_bars(element)
    translator.body.append(ElementTree.tostring(formula, "unicode", short_empty_elements=False))
    raise nodes.SkipNode


def _place_accent(element: ElementTree.Element) -> None:
    """Put an index next to an accented letter, not below it."""
    if element.tag != f"{{{_MATHML}}}munderover" or element[2].text not in _ACCENTS:
        return
    letter, index, accent = element
    accented = ElementTree.Element(f"{{{_MATHML}}}mover", accent="true")
    accented.extend([letter, accent])
    element[:] = [accented, index]
    element.tag = f"{{{_MATHML}}}msub"


def _stretch_bars(element: ElementTree.Element) -> None:
    """Make the bars of an absolute value as high as what stands between them."""
    if len(element) > 1 and element[0].text == element[-1].text == "|":
        element[0].attrib |= {"stretchy": "true", "form": "prefix"}
        element[-1].attrib |= {"stretchy": "true", "form": "postfix"}


def setup(sphinx: Sphinx) -> dict[str, bool]:
    """Register the directives, the links to equations and the formulas."""
    sphinx.add_directive("commands", Commands)
    sphinx.add_directive("code-map", CodeMap)
    sphinx.add_post_transform(EquationLinks)
    sphinx.add_html_math_renderer("mathml", (write_math, None), (write_math, None))
    return {"parallel_read_safe": True}
