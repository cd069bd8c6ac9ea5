"""Picker: a field that offers names; what is typed is looked up here, so that ten thousand fit."""

from collections.abc import Sequence
from typing import Any, Final

from nicegui import events, ui

MOST_OFFERED: Final = 100
"""Names a field offers at a time."""


def picker(label: str, names: Sequence[str], value: Any, *, several: bool = False) -> ui.select:
    """Draw the field; any name may be typed, also one that is not offered."""
    chosen = list(value or []) if several else value or None
    box = ui.select(
        _offered(names, "", chosen),
        label=label,
        value=chosen,
        with_input=True,
        new_value_mode="add-unique",
        multiple=several,
    ).props("outlined dense use-chips" if several else "outlined dense")
    if len(names) > MOST_OFFERED:
        box.props("input-debounce=150")

        def narrow(event: events.GenericEventArguments) -> None:
            box.set_options(_offered(names, str(event.args or ""), box.value))

        box.on("input-value", narrow)
    return box


def _offered(names: Sequence[str], typed: str, chosen: Any) -> list[str]:
    """Return the first names that hold what was typed, those that begin with it first, and the chosen."""
    typed = typed.casefold()
    fitting = sorted((not one.casefold().startswith(typed), one) for one in names if typed in one.casefold())
    kept = chosen if isinstance(chosen, list) else [chosen] if chosen else []
    return list(dict.fromkeys([*kept, *(name for _, name in fitting[:MOST_OFFERED])]))
