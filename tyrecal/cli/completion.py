"""tyrecal completion"""

from __future__ import annotations

import click

from . import options
from .parameters import OneOf
from .terminal import Terminal

# Asked with _TYRECAL_COMPLETE, click tells what completes the words. Its own scripts would take
# NAME=value and --option=value apart, or put a space after NAME=, or split a,b.yaml.
BASH = r"""_tyrecal_completion() {
    local IFS=$'\n' words=() word before cword=$COMP_CWORD place type value
    for place in "${!COMP_WORDS[@]}"; do  # bash takes words apart at '='
        word=${COMP_WORDS[place]}
        if [[ $place -gt 1 && ( $word == = || $before == = ) ]]; then
            words[${#words[@]} - 1]+=$word
            ((place <= COMP_CWORD && cword--))
        else
            words+=("$word")
        fi
        before=$word
    done
    while IFS=, read -r type value; do
        case $type in
            dir) compopt -o dirnames ;;
            file) compopt -o default ;;
            plain) COMPREPLY+=("$value")
                [[ $value == *= ]] && compopt -o nospace
                [[ $value == *.y*ml ]] && compopt -o filenames ;;  # the shell quotes files
        esac
    done < <(COMP_WORDS="${words[*]}" COMP_CWORD=$cword _TYRECAL_COMPLETE=bash_complete "$1")
}
complete -o nosort -F _tyrecal_completion tyrecal"""
ZSH = r"""#compdef tyrecal
_tyrecal_completion() {
    local -a found names described response
    local type key help
    (( $+commands[tyrecal] )) || return 1
    response=("${(@f)$(COMP_WORDS="${words[*]}" COMP_CWORD=$((CURRENT-1)) \
        _TYRECAL_COMPLETE=zsh_complete tyrecal)}")
    for type key help in $response; do
        case $type:$help in
            dir:*) _path_files -/ ;;
            file:*) _path_files -f ;;
            plain:_) [[ $key == *= ]] && names+=($key) || found+=($key) ;;
            plain:*) described+=("$key:$help") ;;
        esac
    done
    [[ -n $described ]] && _describe -V unsorted described -U
    [[ $PREFIX == --*=* ]] && compset -P 1 '*='
    [[ -n $names ]] && compadd -U -i "$IPREFIX" -V unsorted -S '' -a names
    [[ -n $found ]] && compadd -U -i "$IPREFIX" -V unsorted -a found
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then _tyrecal_completion "$@"
else compdef _tyrecal_completion tyrecal; fi"""
FISH = r"""function _tyrecal_completion
    set -l option (string match -rg "^(--[^=]+=)" -- (commandline -t); or echo)
    for line in (_TYRECAL_COMPLETE=fish_complete COMP_WORDS=(commandline -cp) \
            COMP_CWORD=(commandline -t) tyrecal)
        set -l found (string split -m 1 "," $line)
        switch $found[1]
            case dir
                __fish_complete_directories $found[2]
            case file
                __fish_complete_path $found[2]
            case plain
                echo $option$found[2]
        end
    end
end
complete --no-files --command tyrecal --arguments '(_tyrecal_completion)'"""
SCRIPTS = {"bash": BASH, "zsh": ZSH, "fish": FISH}


@click.command()
@click.argument("shell", type=OneOf(list(SCRIPTS)))
@options.with_terminal
def command(shell: str, terminal: Terminal) -> int:
    """Print the script that makes SHELL complete commands, cases, solvers, effects and variables.

    \b
    eval "$(tyrecal completion bash)"                              in ~/.bashrc
    eval "$(tyrecal completion zsh)"                               in ~/.zshrc, after compinit
    tyrecal completion fish > ~/.config/fish/completions/tyrecal.fish
    """
    if terminal.as_json:
        terminal.result({"shell": shell, "script": SCRIPTS[shell]})
    else:
        terminal.say(SCRIPTS[shell])
    return 0
