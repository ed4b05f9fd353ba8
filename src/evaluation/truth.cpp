#include "dynains/evaluation/truth.hpp"

#include <charconv>

#include "dynains/errors.hpp"

namespace dynains::evaluation {
namespace {

/// Reads a class id from the front of `text` and removes it.
std::size_t take_id(std::string_view& text, std::string_view whole) {
  std::size_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || id > 0xffff) {
    throw ConfigError("classes = \"" + std::string(whole) +
                      "\" must be ids in [0, 65535] and ranges, such as \"252-257,259\"");
  }
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return id;
}

}  // namespace

TruthClasses::TruthClasses(Unlabeled unlabeled) : TruthClasses("252-259", unlabeled) {}

TruthClasses::TruthClasses(std::string_view dynamic_classes, Unlabeled unlabeled)
    : unlabeled_(unlabeled) {
  std::string_view rest = dynamic_classes;
  while (true) {
    const std::size_t first = take_id(rest, dynamic_classes);
    std::size_t last = first;
    if (!rest.empty() && rest.front() == '-') {
      rest.remove_prefix(1);
      last = take_id(rest, dynamic_classes);
    }
    const bool more = !rest.empty();
    if (last < first || (more && rest.front() != ',')) {
      throw ConfigError("classes = \"" + std::string(dynamic_classes) +
                        "\" must be ids and rising ranges separated by commas");
    }
    for (std::size_t id = first; id <= last; ++id) dynamic_.set(id);
    if (!more) return;
    rest.remove_prefix(1);
  }
}

std::string TruthClasses::dynamic_classes() const {
  std::string list;
  for (std::size_t first = 0; first < dynamic_.size(); ++first) {
    if (!dynamic_[first]) continue;
    std::size_t last = first;
    while (last + 1 < dynamic_.size() && dynamic_[last + 1]) ++last;
    if (!list.empty()) list += ',';
    list += std::to_string(first);
    if (last > first) list += '-' + std::to_string(last);
    first = last;
  }
  return list;
}

std::string semantic_class_name(std::uint16_t id) {
  switch (id) {
    case 0:
      return "unlabeled";
    case 1:
      return "outlier";
    case 10:
      return "car";
    case 11:
      return "bicycle";
    case 13:
      return "bus";
    case 15:
      return "motorcycle";
    case 16:
      return "on-rails";
    case 18:
      return "truck";
    case 20:
      return "other-vehicle";
    case 30:
      return "person";
    case 31:
      return "bicyclist";
    case 32:
      return "motorcyclist";
    case 40:
      return "road";
    case 44:
      return "parking";
    case 48:
      return "sidewalk";
    case 49:
      return "other-ground";
    case 50:
      return "building";
    case 51:
      return "fence";
    case 52:
      return "other-structure";
    case 60:
      return "lane-marking";
    case 70:
      return "vegetation";
    case 71:
      return "trunk";
    case 72:
      return "terrain";
    case 80:
      return "pole";
    case 81:
      return "traffic-sign";
    case 99:
      return "other-object";
    case 252:
      return "moving-car";
    case 253:
      return "moving-bicyclist";
    case 254:
      return "moving-person";
    case 255:
      return "moving-motorcyclist";
    case 256:
      return "moving-on-rails";
    case 257:
      return "moving-bus";
    case 258:
      return "moving-truck";
    case 259:
      return "moving-other-vehicle";
    default:
      return "class " + std::to_string(id);
  }
}

}  // namespace dynains::evaluation
