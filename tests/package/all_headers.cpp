// Links two translation units that both include every public header: a function or variable that
// is defined twice fails to link, one that is not inline where it should be differs in its address.
const char* first();
const char* second();

int main() { return first() == second() ? 0 : 1; }
