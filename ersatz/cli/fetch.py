"""The public data sets of scans, fetched to this machine."""

from collections.abc import Sequence
from pathlib import Path

import click

from ersatz.cli.options import PATH
from ersatz.cli.terminal import console, progress, say
from ersatz.errors import InputError


@click.command()
@click.argument("data_set", metavar="washington|ycb", required=False, help="The data set.")
@click.argument("folder", metavar="DIR", type=PATH, required=False, help="Folder to fetch it to.")
@click.option("--class", "classes", multiple=True, help="Only the objects of this class; repeatable.")
@click.option("--object", "objects", multiple=True, help="Only this object, such as bowl_1; repeatable.")
@click.option("--url", help="A mirror's folder; without it, the publisher's own.")
@click.option("--unpack/--no-unpack", default=True, help="Unpack the archives beside themselves.")
@click.option("--list", "overview", is_flag=True, help="Say what there is, and whom to cite; fetch nothing.")
def fetch(
    data_set: str | None,
    folder: Path | None,
    classes: tuple[str, ...],
    objects: tuple[str, ...],
    url: str | None,
    unpack: bool,
    overview: bool,
) -> None:
    """Fetch scans of a public data set; what is there is checked, what broke off goes on.

    Checksums are recorded at the first fetch, in checksums.json, and held to from then on.

    Example: ersatz fetch washington scans --class bowl --class plate
    """
    from ersatz.acquisition.fetch import data_set as known
    from ersatz.acquisition.fetch import fetch as fetch_files

    if overview:
        _list([data_set] if data_set else ())
        return
    if data_set is None or folder is None:
        raise InputError(
            "name a data set and a folder, as in `ersatz fetch ycb scans`; --list says what there is"
        )
    data = known(data_set)
    files = data.files(classes, objects)
    with progress() as report:

        def tell(file: str, have: int, total: int) -> None:
            number = files.index(file)
            share = have / total if total else 0.0
            report(
                f"{file}, {have / 1e6:.0f} MB ({number + 1} of {len(files)})", (number + share) / len(files)
            )

        fetch_files(data_set, folder, base=url, files=files, unpack=unpack, progress=tell)
    say(f"{folder}: {len(files)} archive{'s' if len(files) > 1 else ''} of {data_set}, checked")
    say(f"Cite: {data.credit}")
    if unpack:
        say(f"Next: ersatz build kb.ttl --scans {folder} --expert household")


def _list(names: Sequence[str]) -> None:
    """Print the data sets with their classes and the objects of each."""
    from ersatz.acquisition.fetch import DATA_SETS, data_set

    out = console()
    for name in names or DATA_SETS:
        data = data_set(name)
        out.print(f"{name}: {len(data.objects)} objects of {len(data.classes)} classes", highlight=False)
        for object_class in data.classes:
            mine = [one for one, its_class in data.objects.items() if its_class == object_class]
            shown = mine[0] if len(mine) == 1 else f"{mine[0]} ... {mine[-1]}"
            out.print(f"  {object_class:<18} {len(mine):>3}  {shown}", highlight=False)
        out.print(f"  from {data.base}\n  {data.credit}", highlight=False)
