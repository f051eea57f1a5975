// Only adds doubles: the check for double precision must report it.
namespace {

volatile double terms[2] = {1, 2};

}  // namespace

int main() {
    terms[0] = terms[0] + terms[1];
    return 0;
}
