// Must not link: the C library's printf allocates behind one's back.
#include <cstdio>

int main() { return std::printf("%d\n", 1); }
