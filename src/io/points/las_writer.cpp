#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "../failure.hpp"
#include "../scalar.hpp"
#include "dynains/io/las_file.hpp"
#include "las_format.hpp"

namespace dynains {
namespace {

std::string extra_description(const char* name, Scalar type, const char* description) {
  const auto* const types = std::begin(las::kExtraTypes);
  const auto* const number = std::find(types + 1, std::end(las::kExtraTypes), type);
  return ByteWriter()
      .zeros(2)
      .number(static_cast<std::uint8_t>(number - types))
      .number(std::uint8_t{0})
      .text(name, 32)
      .zeros(124)  // no-data, least, most, scale and offset
      .text(description, 32)
      .bytes();
}

std::string vlr(std::string_view user, std::uint16_t record, const std::string& description,
                const std::string& content) {
  return ByteWriter()
             .zeros(2)
             .text(user, 16)
             .number(record)
             .number(static_cast<std::uint16_t>(content.size()))
             .text(description, 32)
             .bytes() +
         content;
}

std::string extra_bytes_vlr() {
  return vlr(las::kMarks.spec_user, las::kMarks.extra_bytes_record, "extra bytes",
             extra_description("belief", Scalar::kFloat, "probability of being dynamic") +
                 extra_description("cause", Scalar::kUint8, "cause of the verdict") +
                 extra_description("instance", Scalar::kUint32, "0: none"));
}

constexpr std::uint8_t kLasPointFormat = 6;

}  // namespace

LasWriter::LasWriter(const std::filesystem::path& path, const LasOptions& options)
    : path_(path), options_(options), file_(path) {
  if (options.wkt.size() >= std::numeric_limits<std::uint16_t>::max()) {
    fail(path, "expected a reference system of less than 65535 bytes");
  }
  least_.fill(std::numeric_limits<std::int32_t>::max());
  most_.fill(std::numeric_limits<std::int32_t>::min());
  file_.stream() << header();
}

/// Has the same length for every number of points.
std::string LasWriter::header() const {
  std::string records = extra_bytes_vlr();
  if (!options_.wkt.empty()) {
    records += vlr("LASF_Projection", 2112, "OGC WKT", options_.wkt + '\0');
  }
  ByteWriter out;
  // Bit 4: coordinate systems are texts (WKT).
  out.text(las::kMarks.magic, las::kMarks.magic.size())
      .zeros(2)
      .number(std::uint16_t{1U << 4U})
      .zeros(16);
  out.number(std::uint8_t{1}).number(std::uint8_t{4});
  out.text("dynains", 32).text("dynains", 32);
  out.zeros(4);  // without a day, so that equal points give equal files
  out.number(static_cast<std::uint16_t>(las::kSizes.header_1_4));
  out.number(static_cast<std::uint32_t>(las::kSizes.header_1_4 + records.size()));
  out.number(std::uint32_t{options_.wkt.empty() ? 1U : 2U});
  const std::size_t extra =
      sizeof(LasPoint::belief) + sizeof(LasPoint::cause) + sizeof(LasPoint::instance);
  out.number(kLasPointFormat);
  out.number(static_cast<std::uint16_t>(las::kPointFormats[kLasPointFormat].size + extra));
  out.zeros(24);  // numbers of points as in older versions
  for (int axis = 0; axis < 3; ++axis) out.number(options_.scale);
  for (const double offset : options_.offset) out.number(offset);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const auto* limit : {&most_, &least_}) {
      const double steps = size_ == 0 ? 0.0 : (*limit)[axis];
      out.number(options_.offset[static_cast<Eigen::Index>(axis)] + steps * options_.scale);
    }
  }
  out.zeros(20);  // no records behind the points
  out.number(std::uint64_t{size_}).number(std::uint64_t{size_}).zeros(14 * 8);  // all first returns
  return out.bytes() + records;
}

void LasWriter::add(const LasPoint& point) {
  const double most = std::numeric_limits<std::int32_t>::max();
  std::array<std::int32_t, 3> steps{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    const double value = std::round((point.position[i] - options_.offset[i]) / options_.scale);
    if (!(std::abs(value) <= most)) {
      fail(path_, "expected points within " + std::to_string(most * options_.scale) +
                      " m of the first one");
    }
    steps[axis] = static_cast<std::int32_t>(value);
    least_[axis] = std::min(least_[axis], steps[axis]);
    most_[axis] = std::max(most_[axis], steps[axis]);
  }
  ByteWriter record;
  for (const std::int32_t step : steps) record.number(step);
  // Return 1 of 1.
  record.number(point.intensity).number(std::uint8_t{1U << 4U | 1U}).number(std::uint8_t{0});
  record.number(point.classification).number(std::uint8_t{0});
  record.number(std::int16_t{0}).number(std::uint16_t{0}).number(point.time);
  record.number(point.belief).number(point.cause).number(point.instance);
  file_.stream() << record.bytes();
  ++size_;
}

void LasWriter::commit(AtomicFile::Sync sync) {
  file_.stream().seekp(0);
  file_.stream() << header();
  file_.commit(sync);
}

}  // namespace dynains
