// write_seeds FOLDER: one folder for each target, one file for each seed.

#include "io/files.hpp"
#include "support/standard.hpp"
#include "targets.hpp"

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::runtime_error("usage: write_seeds FOLDER");
    for (const dynains::fuzz::Target& target : dynains::fuzz::targets()) {
      std::size_t number = 0;
      for (const std::string& seed : target.seeds) {
        const std::string name = "seed" + std::to_string(number++);
        dynains::test::write_text(std::filesystem::path(argv[1]) / target.name / name, seed);
      }
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
