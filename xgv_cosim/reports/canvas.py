"""From a matplotlib figure to a piece of HTML that needs nothing else: inline SVG or PNG data URI.

No pyplot, hence no display and no global figure; the settings apply inside ``drawing`` only.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image, ImageColor

from xgv_cosim.reports.palette import GRID, INK, PANEL, QUIET

PNG_DPI = 150
PNG_COLOURS = 256
"""A picture with a palette takes a fifth of the room of one in full colour."""
WIDTH_IN = 10.6
"""Width of every figure; the page scales it."""

_EXACT = ("#ffffff", PANEL, GRID, INK)
"""Colours of large plain areas, which would show if they were off by a shade."""

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


def stacked(
    heights_in: Sequence[float],
    *,
    gap_in: float,
    left_in: float,
    right_in: float,
    top_in: float,
    bottom_in: float,
) -> tuple[Figure, list[Axes]]:
    """Return a figure that belongs to no window, and its panels from top to bottom, all of one width.

    Places are given in inches: a layout that measures every text costs more than the drawing itself.
    """
    height_in = top_in + sum(heights_in) + gap_in * (len(heights_in) - 1) + bottom_in
    figure = Figure(figsize=(WIDTH_IN, height_in), facecolor="white")
    FigureCanvasAgg(figure)
    panels = []
    top = height_in - top_in
    for panel_in in heights_in:
        place = (left_in, top - panel_in, WIDTH_IN - left_in - right_in, panel_in)
        panels.append(figure.add_axes(_share(place, height_in)))
        top -= panel_in + gap_in
    return figure, panels


def _share(
    place_in: tuple[float, float, float, float], height_in: float
) -> tuple[float, float, float, float]:
    left, bottom, width, height = place_in
    return left / WIDTH_IN, bottom / height_in, width / WIDTH_IN, height / height_in


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
    figure.set_dpi(PNG_DPI)
    raw = io.BytesIO()
    figure.savefig(raw, format="rgba", dpi=PNG_DPI)
    full = Image.frombytes("RGBA", figure.canvas.get_width_height(), raw.getvalue()).convert("RGB")
    sink = io.BytesIO()
    _with_palette(full).save(sink, format="png", optimize=True)
    data = base64.b64encode(sink.getvalue()).decode()
    return Markup('<img alt="{}" src="data:image/png;base64,{}">').format(description, data)


def _with_palette(full: Image.Image) -> Image.Image:
    """Return the picture with a palette of its own.

    Every fourth pixel each way tells the colours in a sixteenth of the time. Maximum coverage keeps rare ones
    (the markers), the refinement keeps the common ones true.
    """
    sample = full.resize((full.width // 4, full.height // 4), Image.Resampling.NEAREST)
    learnt = sample.quantize(PNG_COLOURS - len(_EXACT), method=Image.Quantize.MAXCOVERAGE, kmeans=2)
    exact = [ImageColor.getrgb(colour) for colour in _EXACT]
    colours = [*(channel for colour in exact for channel in colour), *(learnt.getpalette() or [])]
    holder = Image.new("P", (1, 1))
    holder.putpalette(colours)
    nearest = np.array(full.quantize(palette=holder, dither=Image.Dither.NONE))
    red, green, blue = np.moveaxis(np.asarray(full, np.uint32), -1, 0)
    pixels = red << 16 | green << 8 | blue
    for number, colour in enumerate(exact):
        wanted = colour[0] << 16 | colour[1] << 8 | colour[2]
        nearest[pixels == wanted] = number  # the search above is only nearly exact
    few = Image.fromarray(nearest)
    few.putpalette(colours)
    return few
