"""A page from its template, and what stands in it as text: a self-contained HTML file loads nothing else."""

import base64
from importlib import resources
from typing import TYPE_CHECKING, Any

import jinja2

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def rendered(template: str, /, *, folder: str = "airtouch.report", **context: Any) -> str:
    """The HTML of a template file, in which every text of the context is escaped.

    folder: package that holds the file. A name of the template that the context lacks raises jinja2.UndefinedError.
    """
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, undefined=jinja2.StrictUndefined)
    source = (resources.files(folder) / template).read_text("utf-8")
    return environment.from_string(source).render(context)


def embedded(figure: "Figure") -> str:
    """The figure as a page holds it: a PNG as a data URL."""
    from airtouch.report.style import image

    return data_url(image(figure))


def data_url(png: bytes) -> str:
    """A PNG as a data URL."""
    return "data:image/png;base64," + base64.b64encode(png).decode()
