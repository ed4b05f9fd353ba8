#include "input_files.hpp"

#include "dynains/errors.hpp"

namespace dynains::program {

void InputFiles::refuse(const FileIdentity& identity, const std::filesystem::path& output) const {
  const auto input = paths_.find(identity);
  if (input == paths_.end()) return;
  throw IoError(output.string() + ": is read by this command, as " + input->second.string() +
                ", and would be changed; choose another place to write to");
}

}  // namespace dynains::program
