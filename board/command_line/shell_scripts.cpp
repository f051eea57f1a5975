#include "board/command_line/completion.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

// bash splits words at : and =, which belong to values such as can:can0; the script joins them again, and drops from the
// candidates what bash keeps.
constexpr const char* kBash = R"sh(# bash completion for tricoil. The program lists the candidates.
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
)sh";

constexpr const char* kZsh = R"sh(#compdef tricoil
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
)sh";

constexpr const char* kFish = R"sh(# fish completion for tricoil. The program lists the candidates.
function __tricoil_complete
    set -l words (commandline -opc)
    for line in (command $words[1] __complete $words[2..-1] (commandline -ct) 2>/dev/null)
        switch $line
            case ':file'
                __fish_complete_path (commandline -ct)
            case ':folder'
                __fish_complete_directories (commandline -ct)
            case '*'
                echo $line
        end
    end
end
complete -c tricoil -f -a '(__tricoil_complete)'
)sh";

}  // namespace

const std::vector<std::string>& shell_names() {
    static const std::vector<std::string> names{"bash", "zsh", "fish"};
    return names;
}

std::string completion_script(const std::string& shell) {
    constexpr const char* kScripts[] = {kBash, kZsh, kFish};
    return kScripts[index_of_name("shell", shell, shell_names())];
}

}  // namespace tricoil::host
