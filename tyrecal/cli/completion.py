"""tyrecal completion"""

from __future__ import annotations

import click

from . import options
from .talk import Talk

SHELLS = ("bash", "zsh", "fish")
NO_SPACE = (
    "COMPREPLY+=($value)\n",
    "COMPREPLY+=($value)\n            [[ $value == *= ]] && compopt -o nospace\n",
)


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@options.talking
def command(shell: str, talk: Talk) -> int:
    """Print the script that makes SHELL complete commands, cases, solvers, effects and variables.

    \b
    eval "$(tyrecal completion bash)"                              in ~/.bashrc
    eval "$(tyrecal completion zsh)"                               in ~/.zshrc, after compinit
    tyrecal completion fish > ~/.config/fish/completions/tyrecal.fish
    """
    from click.shell_completion import get_completion_class

    from .main import cli

    kind = get_completion_class(shell)
    assert kind is not None
    script = kind(cli, {}, "tyrecal", "_TYRECAL_COMPLETE").source()
    if shell == "bash":  # a value follows NAME= without a space
        script = script.replace(*NO_SPACE)
    if talk.as_json:
        talk.result({"shell": shell, "script": script})
    else:
        talk.say(script)
    return 0
