# bash completion for tricoil. The program lists the candidates.
# bash splits words at : and =, which belong to values such as can:can0; the function joins them again, and drops from the candidates what bash keeps.
_tricoil() {
    local words=() word joined= line typed kept
    for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
        if (( ${#words[@]} )) && [[ -n $joined || $word == [:=]* ]]; then
            words[-1]+=$word
        else
            words+=("$word")
        fi
        [[ $word == *[:=] ]] && joined=1 || joined=
    done
    typed=${words[-1]}
    kept=
    [[ $typed == *[:=]* ]] && kept=${typed%"${typed##*[:=]}"}
    COMPREPLY=()
    while IFS= read -r line; do
        case $line in
            :file) compopt -o default 2>/dev/null ;;
            :folder) compopt -o dirnames 2>/dev/null ;;
            *)
                word=${line%%$'\t'*}
                [[ $word == *[:=] ]] && compopt -o nospace 2>/dev/null
                COMPREPLY+=("${word#"$kept"}")
                ;;
        esac
    done < <("${COMP_WORDS[0]}" __complete "${words[@]}" 2>/dev/null)
}
complete -F _tricoil tricoil
