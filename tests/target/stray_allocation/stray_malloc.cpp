// Must not link: malloc wants _sbrk, and there is none.
#include <cstdlib>

int main(int argc, char**) {
    auto* const memory = static_cast<volatile char*>(std::malloc(static_cast<std::size_t>(argc)));
    memory[0] = 1;
    return memory[0];
}
