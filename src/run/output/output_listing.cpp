#include "output_listing.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "dynains/errors.hpp"

namespace dynains::run {

std::string listed_name(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x1F && byte < 0x7F && c != '%') {
      text += c;
      continue;
    }
    std::array<char, 4> code{};
    std::snprintf(code.data(), code.size(), "%%%02X", static_cast<unsigned>(byte));
    text += code.data();
  }
  return text;
}

bool OutputListing::contains(const std::string& folder, const std::string& name) const {
  const std::string listed = listed_name(name);
  if (folder.empty()) return files.count(listed) > 0;
  const auto found = folders.find(listed_name(folder));
  if (found == folders.end()) return false;
  const std::string& extension = found->second;
  const std::size_t stem = listed.size() - std::min(listed.size(), extension.size());
  return listed.compare(stem, listed.npos, extension) == 0 &&
         scans.count(listed.substr(0, stem)) > 0;
}

nlohmann::ordered_json OutputListing::to_json() const {
  return {{"files", files}, {"folders", folders}, {"scans", scans}};
}

OutputListing read_listing(const std::filesystem::path& file, const nlohmann::ordered_json& marker,
                           const std::string& command) {
  const auto has = [&](const char* field, const std::string& value) {
    return marker.is_object() && marker.contains(field) && marker[field] == value;
  };
  if (!has("program", "dynains") || !has("command", command)) {
    throw IoError(file.string() + ": was not written by dynains " + command +
                  "; choose another folder");
  }
  try {
    const auto& outputs = marker.at("outputs");
    return {outputs.at("files"), outputs.at("folders"), outputs.at("scans")};
  } catch (const nlohmann::json::exception&) {
    throw IoError(file.string() +
                  ": /outputs: expected the names of files, folders and scans; remove the results "
                  "yourself, or choose another folder");
  }
}

}  // namespace dynains::run
