#include "dynains/evaluation/truth.hpp"

#include <charconv>

#include "dynains/errors.hpp"

namespace dynains::evaluation {
namespace {

struct ClassName {
  std::uint16_t id;
  const char* name;
};

/// SemanticKITTI.
constexpr ClassName kClassNames[] = {{0, "unlabeled"},
                                     {1, "outlier"},
                                     {9, "static"},
                                     {10, "car"},
                                     {11, "bicycle"},
                                     {13, "bus"},
                                     {15, "motorcycle"},
                                     {16, "on-rails"},
                                     {18, "truck"},
                                     {20, "other-vehicle"},
                                     {30, "person"},
                                     {31, "bicyclist"},
                                     {32, "motorcyclist"},
                                     {40, "road"},
                                     {44, "parking"},
                                     {48, "sidewalk"},
                                     {49, "other-ground"},
                                     {50, "building"},
                                     {51, "fence"},
                                     {52, "other-structure"},
                                     {60, "lane-marking"},
                                     {70, "vegetation"},
                                     {71, "trunk"},
                                     {72, "terrain"},
                                     {80, "pole"},
                                     {81, "traffic-sign"},
                                     {99, "other-object"},
                                     {251, "moving"},
                                     {252, "moving-car"},
                                     {253, "moving-bicyclist"},
                                     {254, "moving-person"},
                                     {255, "moving-motorcyclist"},
                                     {256, "moving-on-rails"},
                                     {257, "moving-bus"},
                                     {258, "moving-truck"},
                                     {259, "moving-other-vehicle"}};

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

TruthClasses::TruthClasses(Unlabeled unlabeled) : TruthClasses("251-259", unlabeled) {}

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
  for (const ClassName& entry : kClassNames) {
    if (entry.id == id) return entry.name;
  }
  return "class " + std::to_string(id);
}

}  // namespace dynains::evaluation
