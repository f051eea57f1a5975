// Must not link: operator new is in the C++ library, which is not linked.
int main(int argc, char**) {
    auto* const memory = new volatile int[static_cast<unsigned>(argc)];
    memory[0] = 1;
    return memory[0];
}
