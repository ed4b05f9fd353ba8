// Links two translation units that both include every public header. A duplicate definition fails
// to link. A function that should be inline and is not has two addresses.
const char* first();
const char* second();

int main() { return first() == second() ? 0 : 1; }
