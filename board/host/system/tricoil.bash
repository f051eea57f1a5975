# Completion for bash: subcommands and options as the program itself lists them.
_tricoil() {
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]}
    if [ "$COMP_CWORD" -eq 1 ]; then
        mapfile -t COMPREPLY < <(compgen -W "$(tricoil --help 2>/dev/null | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]\+\).*/\1/p')" -- "$word")
    elif [[ $word == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(tricoil "$command" --help 2>/dev/null | grep -oE '(^ +|,)--[a-z-]+' | tr -d ' ,')" -- "$word")
    else
        mapfile -t COMPREPLY < <(compgen -f -- "$word")
    fi
}
complete -o filenames -F _tricoil tricoil
