#include "output_listing.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <string_view>

#include "dynains/errors.hpp"
#include "dynains/io/point_file.hpp"
#include "json_file.hpp"
#include "map_file.hpp"

namespace dynains::program {
namespace {

using ListingJson = nlohmann::ordered_json;

std::string encode(const std::string& name) {
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

/// Nothing unless `text` is the encoded name of an entry of a folder.
std::optional<std::string> decode(const std::string& text) {
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      name += text[i];
      continue;
    }
    const std::string digits = text.substr(i + 1, 2);
    if (digits.size() != 2 || digits.find_first_not_of("0123456789ABCDEF") != digits.npos) {
      return std::nullopt;
    }
    name += static_cast<char>(std::stoi(digits, nullptr, 16));
    i += 2;
  }
  const bool is_name = !name.empty() && name != "." && name != ".." &&
                       name.find('/') == name.npos && name.find('\0') == name.npos;
  return is_name ? std::optional(name) : std::nullopt;
}

class ListingReader {
 public:
  ListingReader(const std::filesystem::path& file, const OutputKind& kind)
      : file_(file), kind_(kind) {}

  OutputListing read(const ListingJson& json) const {
    OutputListing listing;
    for (const ListingJson& entry : field(json, "files", &ListingJson::is_array, "an array")) {
      const std::string name = name_of(entry);
      const bool is_fixed =
          std::find(kind_.files.begin(), kind_.files.end(), name) != kind_.files.end();
      if (!is_fixed && !(kind_.has_map && is_map_name(name))) refuse("files", name);
      listing.files.insert(name);
    }
    const ListingJson& folders = field(json, "folders", &ListingJson::is_object, "an object");
    for (const auto& [name, value] : folders.items()) {
      const auto known = kind_.folders.find(name);
      if (known == kind_.folders.end() || !value.is_string()) refuse("folders", name);
      const auto extension = value.get<std::string>();
      const std::vector<std::string>& extensions = known->second;
      if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
        refuse("folders", name + extension);
      }
      listing.folders[name] = extension;
    }
    for (const ListingJson& entry : field(json, "scans", &ListingJson::is_array, "an array")) {
      listing.scans.insert(name_of(entry));
    }
    return listing;
  }

 private:
  const ListingJson& field(const ListingJson& json, const std::string& name,
                           bool (ListingJson::*is_of_type)() const noexcept,
                           const char* expected) const {
    if (json.is_object() && json.contains(name) && (json[name].*is_of_type)()) return json[name];
    throw IoError(file_.string() + ": /outputs/" + name + ": expected " + expected);
  }

  std::string name_of(const ListingJson& entry) const {
    const std::optional<std::string> name =
        entry.is_string() ? decode(entry.get<std::string>()) : std::nullopt;
    if (name) return *name;
    throw IoError(file_.string() + ": /outputs: expected names of files, found " +
                  entry.dump(-1, ' ', true, ListingJson::error_handler_t::replace));
  }

  [[noreturn]] void refuse(const std::string& list, const std::string& name) const {
    throw IoError(file_.string() + ": /outputs/" + list + ": dynains " + kind_.command +
                  " writes nothing named " + encode(name));
  }

  const std::filesystem::path& file_;
  const OutputKind& kind_;
};

}  // namespace

bool OutputListing::contains(const std::string& folder, const std::string& name) const {
  if (folder.empty()) return files.count(name) > 0;
  const auto found = folders.find(folder);
  if (found == folders.end()) return false;
  const std::string& extension = found->second;
  const std::size_t stem = name.size() - std::min(name.size(), extension.size());
  return name.compare(stem, name.npos, extension) == 0 && scans.count(name.substr(0, stem)) > 0;
}

bool OutputListing::contains(const OutputListing& other) const {
  return std::includes(files.begin(), files.end(), other.files.begin(), other.files.end()) &&
         std::includes(folders.begin(), folders.end(), other.folders.begin(),
                       other.folders.end()) &&
         std::includes(scans.begin(), scans.end(), other.scans.begin(), other.scans.end());
}

nlohmann::ordered_json OutputListing::to_json() const {
  ListingJson json = {{"files", ListingJson::array()},
                      {"folders", ListingJson::object()},
                      {"scans", ListingJson::array()}};
  for (const std::string& name : files) json["files"].push_back(encode(name));
  for (const auto& [name, extension] : folders) json["folders"][name] = extension;
  for (const std::string& name : scans) json["scans"].push_back(encode(name));
  return json;
}

OutputListing read_listing(const std::filesystem::path& file, const nlohmann::ordered_json& marker,
                           const OutputKind& kind) {
  const bool is_ours = marker.is_object() && marker.contains("program") &&
                       marker["program"] == "dynains" &&
                       (!marker.contains("command") || marker["command"] == kind.command);
  if (!is_ours) {
    throw IoError(file.string() + ": was not written by dynains " + kind.command +
                  "; choose another folder");
  }
  if (!marker.contains("command") || !marker.contains("outputs")) {
    throw IoError(file.string() +
                  ": does not list the files of the results, as an older version wrote it; remove "
                  "the results yourself, or choose another folder");
  }
  return ListingReader(file, kind).read(marker["outputs"]);
}

}  // namespace dynains::program
