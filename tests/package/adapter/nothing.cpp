// Program for the case that the library is missing.
int main() { return 0; }
