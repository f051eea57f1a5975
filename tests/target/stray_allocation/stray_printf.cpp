// Must not link: the C library's printf allocates.
#include <cstdio>

int main() { return std::printf("%d\n", 1); }
