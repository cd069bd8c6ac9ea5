"""Pictures of scans and shape concepts."""

from pathlib import Path

import click

from ersatz.cli import options
from ersatz.cli.terminal import say


@click.group(no_args_is_help=False)
def figure() -> None:
    """Draw scans and shape concepts as PNG files."""


@figure.command("scan")
@click.argument("scan", type=options.PATH, help="A scan of an object; of a mesh, one view is drawn.")
@click.option("--out", type=options.PATH, required=True, help="Folder to write the pictures to.")
@options.concepts
def figure_scan(scan: Path, out: Path, concepts: Path | None) -> None:
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


@figure.command("concepts")
@click.option(
    "--unlabelled",
    type=options.PATH,
    required=True,
    help="The folder of scans the concepts were learned from.",
)
@click.option("--out", type=options.PATH, required=True, help="Folder to write the picture to.")
@options.concepts
def figure_concepts(unlabelled: Path, out: Path, concepts: Path | None) -> None:
    """Draw a contact sheet of the shape concepts: one row a concept, its exemplars nearest to its middle.

    Example: ersatz figure concepts --unlabelled scans --out figures
    """
    from ersatz.acquisition.figures import concept_figure
    from ersatz.acquisition.sources import shape_concepts, unlabelled_scans

    out.mkdir(parents=True, exist_ok=True)
    path = concept_figure(shape_concepts(concepts), unlabelled_scans(unlabelled), out / "concepts.png")
    say(f"{path}: written")


@figure.command("drift")
@click.argument(
    "scans",
    type=options.PATH,
    nargs=-1,
    required=True,
    help="Scans of some objects; of a mesh, six views are taken.",
)
@click.option("--out", type=options.PATH, required=True, help="Folder to write the picture to.")
@options.concepts
def figure_drift(scans: tuple[Path, ...], out: Path, concepts: Path | None) -> None:
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
