// `dynains fleet`: starts the module dynains.fleet of Python, which needs Dask.
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <vector>

#include "command.hpp"
#include "dynains/errors.hpp"

namespace dynains::program {
namespace {

/// No code comes from the current folder: -c puts it first in the path of modules.
constexpr const char* kStart = R"(
import sys
sys.path[:] = [folder for folder in sys.path if folder]
try:
    from dynains import fleet
except ImportError as error:
    sys.exit(f"dynains: error: fleet needs the Python module of dynains: {error}")
sys.exit(fleet.main())
)";

/// Replaces this process. Throws IoError if that fails.
[[noreturn]] void start_fleet(const std::vector<std::string>& words) {
  std::vector<std::string> command = {"python3", "-c", kStart};
  command.insert(command.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  std::cout.flush();
  ::setenv("PYTHONSAFEPATH", "1", 1);  // for the workers, which Python starts with -c, too
  ::execvp(arguments.front(), arguments.data());
  throw IoError(std::string("python3, which fleet needs: ") + std::strerror(errno));
}

}  // namespace

void add_fleet_command(CLI::App& app) {
  CLI::App& command = *app.add_subcommand(
      "fleet", "Clean many recordings at once, on many cores or machines (Python and Dask)");
  command.set_help_flag();  // the module has its own help
  command.prefix_command();
  command.callback([&command] { start_fleet(command.remaining()); });
}

}  // namespace dynains::program
