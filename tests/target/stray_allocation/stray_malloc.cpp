// Must not link: malloc needs _sbrk, which does not exist.
#include <cstdlib>

int main(int argc, char**) {
    auto* const memory = static_cast<volatile char*>(std::malloc(static_cast<std::size_t>(argc)));
    memory[0] = 1;
    return memory[0];
}
