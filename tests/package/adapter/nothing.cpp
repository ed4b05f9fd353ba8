// The program where the library is missing.
int main() { return 0; }
