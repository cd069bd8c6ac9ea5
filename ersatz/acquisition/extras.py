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
