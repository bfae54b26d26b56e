"""Completion in shells: click's own scripts, but that no space follows ``seat_width=``."""

from __future__ import annotations

import click
from click.shell_completion import (
    BashComplete,
    FishComplete,
    ShellComplete,
    ZshComplete,
    add_completion_class,
)

VARIABLE = "_SHAPE_EDIT_COMPLETE"
"""Set while a shell asks; click goes by the program's name."""


class _Bash(BashComplete):
    """A value is still to be typed behind ``seat_width=``."""

    source_template = BashComplete.source_template.replace(
        "    return 0", "    [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace\n\n    return 0"
    )

    @staticmethod
    def _check_version() -> None:
        """No bash is asked for its version: the script may be for another machine."""


class _Zsh(ZshComplete):
    """Likewise; such names come with their labels, and are shown apart."""

    source_template = (
        ZshComplete.source_template.replace(
            "    local -a completions_with_descriptions\n",
            "    local -a completions_with_descriptions\n    local -a names\n",
        )
        .replace(
            'if [[ "$descr" == "_" ]]; then',
            'if [[ "$key" == *= ]]; then\n'
            '                names+=("$key":"$descr")\n'
            '            elif [[ "$descr" == "_" ]]; then',
        )
        .replace(
            '    if [ -n "$completions" ]; then',
            '    if [ -n "$names" ]; then\n'
            "        _describe -V unsorted names -U -S ''\n"
            "    fi\n\n"
            '    if [ -n "$completions" ]; then',
        )
    )


SHELLS = ("bash", "zsh", "fish")
_CLASSES: dict[str, type[ShellComplete]] = {"bash": _Bash, "zsh": _Zsh, "fish": FishComplete}

for _class in (_Bash, _Zsh):
    add_completion_class(_class)


def script(shell: str, command: click.Command, name: str) -> str:
    """What the shell is to evaluate, for a command that is called by a name."""
    return _CLASSES[shell](command, {}, name, VARIABLE).source()
