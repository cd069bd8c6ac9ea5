"""Pictures of scans and shape concepts."""

from pathlib import Path
from typing import Annotated

import typer

from ersatz.cli.app import app
from ersatz.cli.options import Concepts
from ersatz.cli.terminal import say

figure_app = typer.Typer(help="Draw scans and shape concepts as PNG files.", rich_markup_mode=None)
app.add_typer(figure_app, name="figure")


@figure_app.command("scan")
def figure_scan(
    scan: Annotated[Path, typer.Argument(help="A scan of an object; of a mesh, one view is drawn.")],
    out: Annotated[Path, typer.Option(help="Folder to write the pictures to.")],
    concepts: Concepts = None,
) -> None:
    """Draw a scan: its segments, its symbols at each level, the tree of compositions, the responses.

    Example: ersatz figure scan mug.ply --out figures
    """
    from ersatz.acquisition.figures import scan_figures
    from ersatz.acquisition.layouts import FolderSettings, views_of
    from ersatz.acquisition.scans import read_scan
    from ersatz.acquisition.sources import shape_concepts

    view = next(iter(views_of(read_scan(scan), FolderSettings(whole=False))))
    for path in scan_figures(view, shape_concepts(concepts), out):
        say(f"{path}: written")


@figure_app.command("concepts")
def figure_concepts(
    unlabelled: Annotated[Path, typer.Option(help="The folder of scans the concepts were learned from.")],
    out: Annotated[Path, typer.Option(help="Folder to write the picture to.")],
    concepts: Concepts = None,
) -> None:
    """Draw a contact sheet of the shape concepts: one row a concept, its exemplars nearest to its middle.

    Example: ersatz figure concepts --unlabelled scans --out figures
    """
    from ersatz.acquisition.figures import concept_figure
    from ersatz.acquisition.sources import shape_concepts, unlabelled_scans

    out.mkdir(parents=True, exist_ok=True)
    path = concept_figure(shape_concepts(concepts), unlabelled_scans(unlabelled), out / "concepts.png")
    say(f"{path}: written")


@figure_app.command("drift")
def figure_drift(
    scans: Annotated[
        list[Path], typer.Argument(help="Scans of some objects; of a mesh, six views are taken.")
    ],
    out: Annotated[Path, typer.Option(help="Folder to write the picture to.")],
    concepts: Concepts = None,
) -> None:
    """Draw how concept responses change when a view loses points or gains noise.

    Example: ersatz figure drift mug.ply bowl.ply box.ply --out figures
    """
    from ersatz.acquisition.drift import drift, drift_figure
    from ersatz.acquisition.layouts import FolderSettings, views_of
    from ersatz.acquisition.scans import read_scan
    from ersatz.acquisition.sources import shape_concepts

    out.mkdir(parents=True, exist_ok=True)
    views = (view for scan in scans for view in views_of(read_scan(scan), FolderSettings(whole=False)))
    path = drift_figure(drift(views, shape_concepts(concepts)), out / "drift.png")
    say(f"{path}: written")
