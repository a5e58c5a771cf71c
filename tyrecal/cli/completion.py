"""tyrecal completion"""

from __future__ import annotations

import click

from . import options
from .talk import Talk

SHELLS = ("bash", "zsh", "fish")
MENDED = {  # of click's scripts: a line of each, and what stands in its place
    "bash": [
        (  # bash takes words apart at '=': NAME=value and --option=value are one
            '    response=$(env COMP_WORDS="${COMP_WORDS[*]}" COMP_CWORD=$COMP_CWORD ',
            "    local words=() word before cword=$COMP_CWORD place\n"
            '    for place in "${!COMP_WORDS[@]}"; do\n'
            "        word=${COMP_WORDS[place]}\n"
            "        if [[ $place -gt 1 && ( $word == = || $before == = ) ]]; then\n"
            "            words[${#words[@]} - 1]+=$word\n"
            "            ((place <= COMP_CWORD && cword--))\n"
            "        else\n"
            '            words+=("$word")\n'
            "        fi\n"
            "        before=$word\n"
            "    done\n"
            '    response=$(env COMP_WORDS="${words[*]}" COMP_CWORD=$cword ',
        ),
        (  # a value follows NAME= without a space; the shell quotes what is a file
            "COMPREPLY+=($value)\n",
            'COMPREPLY+=("$value")\n'
            "            [[ $value == *= ]] && compopt -o nospace\n"
            "            [[ $value == *.y*ml ]] && compopt -o filenames\n",
        ),
    ],
    "zsh": [
        (  # NAME= likewise; of --option=value the option stays
            "compadd -U -V unsorted -a completions\n",
            "[[ $PREFIX == --*=* ]] && compset -P 1 '*='\n"
            "        local -a names=(${(M)completions:#*=})\n"
            "        completions=(${completions:#*=})\n"
            "        compadd -U -i \"$IPREFIX\" -V unsorted -S '' -a names\n"
            '        compadd -U -i "$IPREFIX" -V unsorted -a completions\n',
        )
    ],
    "fish": [
        ('string split "," $completion', 'string split -m 1 "," $completion'),  # a,b.yaml
        (
            "echo $metadata[2];",
            'echo (string match -rg "^(--[^=]+=)" -- (commandline -t); or echo)$metadata[2];',
        ),
    ],
}


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
    for line, mended in MENDED[shell]:
        script = script.replace(line, mended)
    if talk.as_json:
        talk.result({"shell": shell, "script": script})
    else:
        talk.say(script)
    return 0
