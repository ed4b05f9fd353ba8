#include "page.hpp"

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "dynains/evaluation/causes.hpp"
#include "page_files.hpp"
#include "point_packer.hpp"

namespace dynains::viewer {
namespace {

using Json = nlohmann::ordered_json;

std::string base64(const std::string& bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      group = group << 8U | (k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0U);
    }
    for (std::size_t digit = 0; digit < 4; ++digit) {
      const bool is_padding = i + digit > bytes.size();
      text += is_padding ? '=' : kDigits[group >> (18 - 6 * digit) & 63U];
    }
  }
  return text;
}

Json coordinates(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }

Json describe(const ViewData& data, const Json& packing) {
  Json scans = Json::array();
  for (const ViewScan& scan : data.scans) {
    scans.push_back({{"name", scan.name},
                     {"time", scan.time},
                     {"position", coordinates(scan.position.cast<double>())}});
  }
  Json causes = Json::array();
  for (std::size_t cause = 0; cause < kCauseCount; ++cause) {
    causes.push_back({{"name", evaluation::kCauseNames[cause]},
                      {"moving", is_dynamic(static_cast<Cause>(cause))},
                      {"points", data.counts.by_cause[cause]}});
  }
  const ViewCounts& counts = data.counts;
  return {{"title", data.title},
          {"origin", coordinates(data.origin)},
          {"scans", scans},
          {"causes", causes},
          {"counts",
           {{"points", counts.points},
            {"moving", counts.moving},
            {"missed", counts.missed},
            {"lost", counts.lost}}},
          {"has_truth", data.has_truth},
          {"has_beliefs", data.has_beliefs},
          {"packing", packing}};
}

/// JSON that is valid within a script element: `</script>` would end it.
std::string script_json(const Json& json) {
  std::string text;
  for (const char c : json.dump(-1, ' ', true, Json::error_handler_t::replace)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

}  // namespace

void write_page(std::ostream& out, const ViewData& data) {
  const PackedPoints points = pack(data);
  const auto content_of = [&](std::string_view mark) -> std::string {
    if (mark == "style") return std::string(kPageStyle);
    if (mark == "script") return std::string(kPageScript);
    if (mark == "description") return script_json(describe(data, points.description));
    return base64(points.bytes);
  };
  // Each {{NAME}} becomes content_of(NAME).
  std::string_view html = kPageHtml;
  for (std::size_t begin = html.find("{{"); begin != html.npos; begin = html.find("{{")) {
    const std::size_t end = html.find("}}", begin);
    out << html.substr(0, begin) << content_of(html.substr(begin + 2, end - begin - 2));
    html.remove_prefix(end + 2);
  }
  out << html;
}

}  // namespace dynains::viewer
