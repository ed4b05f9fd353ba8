#include "frame_file.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "failure.hpp"
#include "text.hpp"

#if defined(DYNAINS_HAS_EXPAT)
#include <expat.h>
#endif
#if defined(DYNAINS_HAS_YAML)
#include <yaml.h>
#endif

namespace dynains {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargest = 64U << 20U;        // bytes
[[maybe_unused]] constexpr std::size_t kDeepest = 64;  // nested elements; libraries are slow beyond

[[maybe_unused]] std::string read_whole(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, "cannot be opened");
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || size > kLargest) fail(path, "expected a file of at most 64 MiB");
  return {std::istreambuf_iterator<char>(file), {}};
}

[[maybe_unused]] detail::Quaternion of_angles(double roll, double pitch, double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

/// Adds a transform that a file has at `line`.
[[maybe_unused]] void add(const fs::path& path, std::uint64_t line, const StampedPose& pose,
                          TransformTree& tree) {
  if (pose.frame.empty() || pose.child.empty() || pose.frame == pose.child) {
    fail_at_line(path, line, "expected the names of two frames");
  }
  constexpr double kFarthest = 1e5;  // m
  if (!(pose.T_frame_child.translation().norm() < kFarthest)) {
    fail_at_line(path, line, "expected frames at most 100 km apart");
  }
  if (tree.has(pose.child)) {
    fail_at_line(path, line, "frame " + pose.child + " has a transform already");
  }
  tree.add(pose, true);
}

#if defined(DYNAINS_HAS_EXPAT)

/// Three finite numbers, separated by blanks.
std::optional<Eigen::Vector3d> three_numbers(std::string_view text) {
  Eigen::Vector3d v;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto number = text::parse_number(text::next_token(text));
    if (!number || !std::isfinite(*number)) return std::nullopt;
    v[axis] = *number;
  }
  if (!text::next_token(text).empty()) return std::nullopt;
  return v;
}

/// Collects the joints of a robot. An exception must not pass through the C library: the first
/// error is kept.
class UrdfReader {
 public:
  explicit UrdfReader(const fs::path& path)
      : path_(path), parser_(XML_ParserCreate(nullptr), XML_ParserFree) {
    if (!parser_) throw std::bad_alloc();
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), on_start, on_end);
  }

  TransformTree read() {
    const std::string text = read_whole(path_);
    const bool is_parsed =
        XML_Parse(parser_.get(), text.data(), static_cast<int>(text.size()), 1) == XML_STATUS_OK;
    if (!error_.empty()) fail_at_line(path_, error_line_, error_);
    if (!is_parsed) {
      const char* const reason = XML_ErrorString(XML_GetErrorCode(parser_.get()));
      fail_at_line(path_, line(), std::string(reason) + "; expected a robot description (XML)");
    }
    if (!has_robot_) fail_at_line(path_, 1, "expected an element <robot>");
    for (const auto& [at, joint] : joints_) add(path_, at, joint, tree_);
    return std::move(tree_);
  }

 private:
  std::uint64_t line() const { return XML_GetCurrentLineNumber(parser_.get()); }

  void refuse(const std::string& what) {
    if (!error_.empty()) return;
    error_ = what;
    error_line_ = line();
    XML_StopParser(parser_.get(), XML_FALSE);
  }

  void start(std::string_view name, const char** attributes) {
    if (++depth_ > kDeepest) refuse("expected at most 64 nested elements");
    if (depth_ == 1) {
      has_robot_ = name == "robot";
      if (!has_robot_) refuse("expected an element <robot>, found <" + std::string(name) + ">");
    } else if (depth_ == 2 && name == "joint") {
      joint_ = StampedPose();
      joint_line_ = line();
      is_in_joint_ = true;
    } else if (depth_ == 3 && is_in_joint_) {
      start_of_joint(name, attributes);
    }
  }

  void start_of_joint(std::string_view name, const char** attributes) {
    for (; *attributes != nullptr; attributes += 2) {
      const std::string_view key = attributes[0];
      if (name == "parent" && key == "link") joint_.frame = attributes[1];
      if (name == "child" && key == "link") joint_.child = attributes[1];
      if (name != "origin") continue;
      if (key != "xyz" && key != "rpy") continue;
      const auto numbers = three_numbers(attributes[1]);
      if (!numbers) {
        return refuse("expected three numbers as " + std::string(key) + ", found \"" +
                      attributes[1] + '"');
      }
      if (key == "xyz") {
        joint_.T_frame_child.translation() = *numbers;
      } else {
        joint_.T_frame_child.linear() =
            of_angles(numbers->x(), numbers->y(), numbers->z()).toRotationMatrix();
      }
    }
  }

  void end() {
    if (depth_ == 2 && is_in_joint_) {
      joints_.emplace_back(joint_line_, joint_);
      is_in_joint_ = false;
    }
    --depth_;
  }

  static void on_start(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<UrdfReader*>(self)->start(name, attributes);
  }
  static void on_end(void* self, const XML_Char*) { static_cast<UrdfReader*>(self)->end(); }

  fs::path path_;
  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
  std::vector<std::pair<std::uint64_t, StampedPose>> joints_;  // with their lines
  TransformTree tree_;
  StampedPose joint_;
  std::uint64_t joint_line_ = 0;
  std::size_t depth_ = 0;
  bool has_robot_ = false;
  bool is_in_joint_ = false;
  std::string error_;
  std::uint64_t error_line_ = 0;
};

TransformTree read_urdf(const fs::path& path) { return UrdfReader(path).read(); }

#else

TransformTree read_urdf(const fs::path& path) {
  fail(path, "robot descriptions need expat (Debian: libexpat1-dev) when dynains is built");
}

#endif

#if defined(DYNAINS_HAS_YAML)

/// Throws for a text with more than kDeepest nested brackets.
void check_nesting(const fs::path& path, const std::string& text) {
  std::size_t depth = 0;
  std::uint64_t line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') ++depth;
    if ((c == ']' || c == '}') && depth > 0) --depth;
    if (depth > kDeepest) fail_at_line(path, line, "expected at most 64 nested brackets");
  }
}

/// The nodes of a document.
class YamlFile {
 public:
  explicit YamlFile(const fs::path& path) : path_(path), text_(read_whole(path)) {
    check_nesting(path, text_);
    yaml_parser_t parser;
    if (yaml_parser_initialize(&parser) == 0) throw std::bad_alloc();
    const std::unique_ptr<yaml_parser_t, decltype(&yaml_parser_delete)> owner(&parser,
                                                                              yaml_parser_delete);
    yaml_parser_set_input_string(
        &parser,
        reinterpret_cast<const unsigned char*>(text_.data()),  // NOLINT: the library's type
        text_.size());
    if (yaml_parser_load(&parser, &document_) == 0) {
      fail_at_line(path, parser.problem_mark.line + 1,
                   std::string(parser.problem != nullptr ? parser.problem : "no YAML") +
                       "; expected static transforms (YAML)");
    }
  }
  ~YamlFile() { yaml_document_delete(&document_); }
  YamlFile(const YamlFile&) = delete;
  YamlFile& operator=(const YamlFile&) = delete;

  TransformTree transforms() {
    yaml_node_t* list = yaml_document_get_root_node(&document_);
    if (list != nullptr && list->type == YAML_MAPPING_NODE) list = find(*list, "transforms");
    if (list == nullptr || list->type != YAML_SEQUENCE_NODE) {
      fail_at_line(path_, 1, "expected a list of transforms, or a map with the key transforms");
    }
    TransformTree tree;
    for (const auto* item = list->data.sequence.items.start; item < list->data.sequence.items.top;
         ++item) {
      const yaml_node_t& entry = *yaml_document_get_node(&document_, *item);
      add(path_, line_of(entry), pose_of(entry), tree);
    }
    return tree;
  }

 private:
  static std::uint64_t line_of(const yaml_node_t& node) { return node.start_mark.line + 1; }

  static std::string_view text_of(const yaml_node_t& node) {
    if (node.type != YAML_SCALAR_NODE) return {};
    return {reinterpret_cast<const char*>(node.data.scalar.value),  // NOLINT: as above
            node.data.scalar.length};
  }

  yaml_node_t* find(const yaml_node_t& map, std::string_view key) {
    if (map.type != YAML_MAPPING_NODE) return nullptr;
    for (const auto* pair = map.data.mapping.pairs.start; pair < map.data.mapping.pairs.top;
         ++pair) {
      const yaml_node_t* const name = yaml_document_get_node(&document_, pair->key);
      if (name != nullptr && text_of(*name) == key) {
        return yaml_document_get_node(&document_, pair->value);
      }
    }
    return nullptr;
  }

  std::string name_of(const yaml_node_t& entry, const char* key, const char* other) {
    const yaml_node_t* node = find(entry, key);
    if (node == nullptr) node = find(entry, other);
    if (node == nullptr) return {};
    return std::string(text_of(*node));
  }

  /// The numbers of `keys`; empty if the first is missing.
  template <std::size_t count>
  std::optional<std::array<double, count>> numbers_of(const yaml_node_t& map,
                                                      const std::array<const char*, count>& keys) {
    std::array<double, count> numbers{};
    for (std::size_t i = 0; i < count; ++i) {
      const yaml_node_t* const node = find(map, keys[i]);
      if (node == nullptr && i == 0) return std::nullopt;
      const auto number = node == nullptr ? std::nullopt : text::parse_number(text_of(*node));
      if (!number || !std::isfinite(*number)) {
        fail_at_line(path_, line_of(node == nullptr ? map : *node),
                     std::string("expected a number as ") + keys[i]);
      }
      numbers[i] = *number;
    }
    return numbers;
  }

  StampedPose pose_of(const yaml_node_t& entry) {
    StampedPose pose;
    const yaml_node_t* const header = find(entry, "header");
    pose.frame = name_of(header != nullptr ? *header : entry, "frame_id", "parent");
    pose.child = name_of(entry, "child_frame_id", "child");
    const yaml_node_t* const transform = find(entry, "transform");
    const yaml_node_t* translation = &entry;
    const yaml_node_t* rotation = &entry;
    if (transform != nullptr) {
      translation = find(*transform, "translation");
      rotation = find(*transform, "rotation");
    }
    const auto t =
        translation == nullptr ? std::nullopt : numbers_of<3>(*translation, {"x", "y", "z"});
    if (!t) fail_at_line(path_, line_of(entry), "expected x, y and z");
    pose.T_frame_child.translation() = Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]);
    if (rotation != nullptr) pose.T_frame_child.linear() = rotation_of(*rotation, transform);
    return pose;
  }

  Eigen::Matrix3d rotation_of(const yaml_node_t& map, const yaml_node_t* transform) {
    const auto q = transform != nullptr ? numbers_of<4>(map, {"x", "y", "z", "w"})
                                        : numbers_of<4>(map, {"qx", "qy", "qz", "qw"});
    if (q) {
      const detail::Quaternion rotation((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
      if (!(std::abs(rotation.norm() - 1.0) < 0.01)) {
        fail_at_line(path_, line_of(map), "expected a quaternion of length 1");
      }
      return rotation.normalized().toRotationMatrix();
    }
    const auto angles = numbers_of<3>(map, {"roll", "pitch", "yaw"});
    if (!angles) return Eigen::Matrix3d::Identity();
    return of_angles((*angles)[0], (*angles)[1], (*angles)[2]).toRotationMatrix();
  }

  fs::path path_;
  std::string text_;
  yaml_document_t document_{};
};

TransformTree read_yaml(const fs::path& path) { return YamlFile(path).transforms(); }

#else

TransformTree read_yaml(const fs::path& path) {
  fail(path, "static transforms need libyaml (Debian: libyaml-dev) when dynains is built");
}

#endif

}  // namespace

bool is_frame_file(const fs::path& path) {
  const std::string extension = text::lower_case(path.extension().string());
  return extension == ".urdf" || extension == ".yaml" || extension == ".yml";
}

TransformTree read_frame_file(const fs::path& path) {
  return text::lower_case(path.extension().string()) == ".urdf" ? read_urdf(path) : read_yaml(path);
}

}  // namespace dynains
