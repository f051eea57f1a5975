// Adds doubles and does nothing else with them: the check for double precision must see it.
namespace {

volatile double terms[2] = {1, 2};

}  // namespace

int main() {
    terms[0] = terms[0] + terms[1];
    return 0;
}
