"""The look of figures: colours that colour-blind people and printers keep apart, and one style.

Sequential values use viridis, in which nothing is grey; categories use the palette of Okabe and Ito.
"""

from typing import Any, Final

BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#7F7F7F"
STYLE: Final[dict[Any, Any]] = {
    "font.size": 9.0,
    "font.family": "DejaVu Sans",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "ersatz",
    "svg.fonttype": "path",
    "figure.dpi": 100,
    "savefig.dpi": 150,
}
