#compdef tricoil
# zsh completion for tricoil. The program lists the candidates.
_tricoil() {
    local line word
    local -a candidates shown open open_shown
    for line in ${(f)"$(${words[1]} __complete "${(@Q)words[2,CURRENT]}" 2>/dev/null)"}; do
        word=${line%%$'\t'*}
        case $line in
            :file) _files ;;
            :folder) _files -/ ;;
            *:$'\t'*) open+=("$word"); open_shown+=("$word  ${line#*$'\t'}") ;;
            *) candidates+=("$word"); shown+=("$word  ${line#*$'\t'}") ;;
        esac
    done
    (( ${#candidates} )) && compadd -l -d shown -a candidates
    (( ${#open} )) && compadd -l -S '' -d open_shown -a open
    return 0
}
if [ "$funcstack[1]" = "_tricoil" ]; then
    _tricoil
elif (( $+functions[compdef] )); then
    compdef _tricoil tricoil
fi
