"""`shape-edit completion`."""

from __future__ import annotations

import os
from pathlib import Path

import click

from service.cli.shells import SHELLS, script


@click.command()
@click.argument("shell", required=False, type=click.Choice(SHELLS))
def completion(shell: str | None) -> None:
    """Print what makes a shell complete commands, options, categories and parameters.

    SHELL is by default the one that $SHELL names.

    \b
    Examples:
      eval "$(shape-edit completion bash)"                                      # ~/.bashrc
      eval "$(shape-edit completion zsh)"                                       # ~/.zshrc
      shape-edit completion fish > ~/.config/fish/completions/shape-edit.fish
    """
    own = Path(os.environ.get("SHELL", "")).name
    chosen = shell or (own if own in SHELLS else None)
    if chosen is None:
        raise click.UsageError(f"Name a shell: {', '.join(SHELLS)}.")
    root = click.get_current_context().find_root()
    click.echo(script(chosen, root.command, root.info_name or ""))
