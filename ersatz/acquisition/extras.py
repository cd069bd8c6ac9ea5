"""Optional packages, imported when first needed, with an error that says how to get them."""

from importlib import import_module
from types import ModuleType

from ersatz.errors import MissingDependencyError


def open3d() -> ModuleType:
    """Return the module open3d.

    Raises
    ------
    MissingDependencyError
        If it, or a system library it needs, is missing.
    """
    try:
        return import_module("open3d")
    except (ImportError, OSError) as error:
        raise MissingDependencyError(
            f"scans need open3d ({error}): pip install 'ersatz[scans]', and on Debian or Ubuntu "
            "also apt-get install libusb-1.0-0 libgl1 libegl1"
        ) from error


def parquet() -> ModuleType:
    """Return pyarrow.parquet.

    Raises
    ------
    MissingDependencyError
        If pyarrow or fsspec is missing.
    """
    try:
        import_module("fsspec")
        return import_module("pyarrow.parquet")
    except ImportError as error:
        raise MissingDependencyError(
            f"Parquet in parts needs pyarrow and fsspec ({error}): pip install 'ersatz[scale]'"
        ) from error


def distributed() -> ModuleType:
    """Return the module distributed, Dask's scheduler and workers.

    Raises
    ------
    MissingDependencyError
        If it is missing.
    """
    try:
        return import_module("distributed")
    except ImportError as error:
        raise MissingDependencyError(
            f"--scheduler needs Dask ({error}): pip install 'ersatz[scale]'"
        ) from error


def pyplot() -> ModuleType:
    """Return matplotlib.pyplot, drawing to files only.

    Raises
    ------
    MissingDependencyError
        If matplotlib is missing.
    """
    try:
        import_module("matplotlib").use("Agg")
        return import_module("matplotlib.pyplot")
    except ImportError as error:
        raise MissingDependencyError(
            f"figures need matplotlib ({error}): pip install 'ersatz[figures]'"
        ) from error
