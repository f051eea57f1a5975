# bash completion for tricoil, from the program's --help.
_tricoil() {
    local current=${COMP_WORDS[COMP_CWORD]} words=() word
    for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
        [[ $word == [a-z]* ]] && words+=("$word") || break
    done
    local help
    help=$(tricoil "${words[@]}" --help 2>/dev/null) || return
    if [[ $current == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(grep -oE -- '--[a-z0-9-]+' <<<"$help" | sort -u)" -- "$current")
    else
        mapfile -t COMPREPLY < <(compgen -W "$(sed -n '/^Subcommands:/,$s/^  \([a-z-]*\).*/\1/p' <<<"$help")" -- "$current")
        compopt -o default
    fi
}
complete -F _tricoil tricoil
