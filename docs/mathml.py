"""Formulas of the site as MathML, which browsers draw themselves: no script and no network are needed to read them."""

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)


def _mathml(node: nodes.Element, as_block: bool) -> str:
    text = node.astext()
    if as_block and "\\\\" in text and "\\begin" not in text:
        text = f"\\begin{{aligned}}{text}\\end{{aligned}}"
    # LaTeX reads two digits after \frac as two arguments; docutils reads them as one number.
    text = re.sub(r"(\\[dt]?frac)\s*(\d)", r"\1{\2}", text)
    text = re.sub(r"(\\[dt]?frac\{\d\})\s*(\d)", r"\1{\2}", text)
    try:
        return tex2mathml(text, as_block=as_block)
    except MathError as error:
        # -W makes an error of it: docutils knows fewer commands than LaTeX, such as \left for \Big.
        logger.warning("formula %r: %s", text, error, location=node)
        return text


def _inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(self.starttag(node, "span", "", CLASS="math notranslate nohighlight"))
    self.body.append(_mathml(node, as_block=False) + "</span>")
    raise nodes.SkipNode


def _display(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(self.starttag(node, "div", CLASS="math notranslate nohighlight"))
    if node["number"]:
        self.body.append(f'<span class="eqno">({get_node_equation_number(self, node)})')
        self.add_permalink_ref(node, "Link to this equation")
        self.body.append("</span>")
    self.body.append(_mathml(node, as_block=True) + "</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the renderer under the name that `html_math_renderer` of conf.py gives."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
