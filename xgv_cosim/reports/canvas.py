"""From a matplotlib figure to a piece of HTML that needs nothing else: inline SVG or PNG data URI.

No pyplot, hence no display and no global figure; the settings apply inside ``drawing`` only.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from xgv_cosim.reports.palette import GRID, INK, PANEL, QUIET

PNG_DPI = 170

_SETTINGS: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": GRID,
    "axes.facecolor": PANEL,
    "axes.grid": True,
    "axes.labelcolor": QUIET,
    "axes.labelsize": 9.0,
    "axes.titlesize": 10.0,
    "font.family": "DejaVu Sans",  # ships with matplotlib, so that pictures are the same everywhere
    "font.size": 9.0,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "path.simplify_threshold": 0.3,
    "svg.fonttype": "none",
    "text.color": INK,
    "text.parse_math": False,  # a vehicle may be called $x$
    "xtick.color": QUIET,
    "xtick.labelsize": 8.5,
    "ytick.color": QUIET,
    "ytick.labelsize": 8.5,
}

_METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
_NAMESPACES = re.compile(r'\sxmlns(:\w+)?="[^"]*"')
_SIZE = re.compile(r'(<svg[^>]*?)\sheight="[^"]*"([^>]*?)\swidth="[^"]*"')


@contextmanager
def drawing(salt: str) -> Iterator[None]:
    """Apply the report's style to figures made and rendered inside; ``salt`` keeps SVG ids apart."""
    with mpl.rc_context({**_SETTINGS, "svg.hashsalt": salt}):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return a figure that belongs to no window."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def tidy(axes: Axes) -> None:
    """Drop the frame's upper and right line and all tick marks."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(length=0)


def as_svg(figure: Figure, description: str) -> Markup:
    """Return the figure as inline SVG without any address in it."""
    sink = io.StringIO()
    figure.savefig(sink, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = sink.getvalue()
    text = _METADATA.sub("", text[text.index("<svg") :])
    text = _SIZE.sub(r"\1\2", text, count=1)
    text = _NAMESPACES.sub("", text).replace("xlink:href", "href")
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{escape(description)}"', 1))  # noqa: S704 - matplotlib escapes its texts


def as_png(figure: Figure, description: str) -> Markup:
    """Return the figure as an image with its pixels inside the page."""
    sink = io.BytesIO()
    figure.savefig(sink, format="png", dpi=PNG_DPI)
    data = base64.b64encode(sink.getvalue()).decode()
    return Markup('<img alt="{}" src="data:image/png;base64,{}">').format(description, data)
