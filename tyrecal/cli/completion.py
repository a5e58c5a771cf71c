"""tyrecal completion"""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from . import options
from .parameters import OneOf
from .terminal import Terminal

VARIABLE = "_TYRECAL_COMPLETE"  # with it, click reports what completes the words


@click.command()
@click.argument("shell", type=OneOf(["bash", "zsh", "fish"]))
@options.with_terminal
def command(shell: str, terminal: Terminal) -> int:
    """Print the script that makes SHELL complete commands, cases, solvers, effects and variables.

    \b
    eval "$(tyrecal completion bash)"                              in ~/.bashrc
    eval "$(tyrecal completion zsh)"                               in ~/.zshrc, after compinit
    tyrecal completion fish > ~/.config/fish/completions/tyrecal.fish

    Write '--mesh ', not '--mesh=', before a name to complete: after '=' bash and fish complete
    nothing, bash on the rest of the line too, and zsh replaces the word. Bash and zsh put a space
    after 'NAME=': delete it. The shell completes cases whose names have commas or spaces.
    """
    kind = get_completion_class(shell)
    assert kind
    program = click.get_current_context().find_root().command
    script = kind(program, {}, "tyrecal", VARIABLE).source()
    if terminal.as_json:
        terminal.result({"shell": shell, "script": script})
    else:
        terminal.say(script)
    return 0
