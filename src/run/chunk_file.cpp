#include "chunk_file.hpp"

#include <algorithm>
#include <cstring>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"

namespace dynains::program {
namespace {

// A file is a sequence of words of 8 bytes: magic and version, key; for each scan the number of
// bytes of its verdict, the arrays of the verdict and its moving points; the summary; the map, in
// parts of some blocks; and last the position of the summary and the checksum of all words before.
// An array is the number of its bytes, the bytes, and zeros up to a whole word. Numbers have the
// byte order of the machine, which the version tells.
constexpr std::uint64_t kMagic = 0x4B4E5543594E5944U;
constexpr std::uint64_t kVersion = 4;
constexpr std::size_t kWord = 8;
constexpr std::uint64_t kHeader = 5 * kWord;
constexpr std::uint64_t kTrailer = 2 * kWord;

constexpr std::size_t padded(std::size_t size) { return (size + kWord - 1) / kWord * kWord; }

/// The sum with one more word.
std::uint64_t mixed(std::uint64_t sum, const char* word) {
  std::uint64_t value = 0;
  std::memcpy(&value, word, kWord);
  sum = (sum ^ value) * 0x9E3779B97F4A7C15U;
  return sum ^ sum >> 32U;
}

}  // namespace

void Checksum::add(const char* data, std::size_t size) {
  const char* const end = data + size;
  const auto add_one = [&] {
    sums_[next_] = mixed(sums_[next_], data);
    next_ = (next_ + 1) % sums_.size();
    data += kWord;
  };
  while (data != end && next_ != 0) add_one();
  constexpr std::size_t kTurn = 4 * kWord;
  std::array<std::uint64_t, 4> sums = sums_;
  for (; static_cast<std::size_t>(end - data) >= kTurn; data += kTurn) {
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = mixed(sums[i], data + i * kWord);
  }
  sums_ = sums;
  while (data != end) add_one();
}

std::uint64_t Checksum::value() const {
  std::uint64_t result = 0;
  for (const std::uint64_t sum : sums_) {
    result = (result ^ sum) * 0x9E3779B97F4A7C15U;
    result ^= result >> 32U;
  }
  return result;
}

ChunkFileWriter::ChunkFileWriter(const std::filesystem::path& file, const ChunkKey& key)
    : file_(file) {
  for (const std::uint64_t number : {kMagic, kVersion, key.request, key.first, key.scans}) {
    put_number(number);
  }
}

void ChunkFileWriter::write(const void* data, std::size_t size) {
  const auto* const bytes = static_cast<const char*>(data);
  const std::size_t whole = size / kWord * kWord;
  checksum_.add(bytes, whole);
  file_.stream().write(bytes, static_cast<std::streamsize>(whole));
  if (whole < size) {
    std::array<char, kWord> rest{};
    std::memcpy(rest.data(), bytes + whole, size - whole);
    checksum_.add(rest.data(), kWord);
    file_.stream().write(rest.data(), kWord);
  }
  position_ += padded(size);
}

template <class T>
void ChunkFileWriter::put(Span<const T> values) {
  const std::size_t size = values.size() * sizeof(T);
  put_number(size);
  if (size > 0) write(values.data(), size);
}

void ChunkFileWriter::put_number(std::uint64_t value) { write(&value, sizeof(value)); }

void ChunkFileWriter::add(const ChunkScan& scan) {
  runs_.assign(scan);
  const auto stored = [](const auto& values) {
    return kWord + padded(values.size() * sizeof(values[0]));
  };
  put_number(stored(runs_.ends) + stored(runs_.instances) + stored(runs_.labels) +
             stored(runs_.causes) + stored(scan.beliefs) + stored(scan.online));
  put<const std::uint32_t>(runs_.ends);
  put<const std::uint32_t>(runs_.instances);
  put<const PointLabel>(runs_.labels);
  put<const Cause>(runs_.causes);
  put<const float>(scan.beliefs);
  put<const PointLabel>(scan.online);
  put<const char>(scan.moving);
}

void ChunkFileWriter::finish(const ChunkSummary& summary, const StaticMapAccumulator& map) {
  const std::uint64_t begin = position_;
  put_number(summary.points);
  put<const std::uint64_t>(summary.labels.of);
  put<const std::uint32_t>(summary.instances.shared_before);
  put<const std::uint32_t>(summary.instances.shared_behind);
  put<const std::uint32_t>(summary.instances.still_before);
  put<const std::uint32_t>(summary.instances.moving_behind);
  put_number(summary.instances.last);
  std::vector<std::uint32_t> pixels;
  std::vector<float> heights;
  std::vector<std::uint8_t> greys, moving;
  for (const Overview::Place& place : summary.overview) {
    pixels.push_back(place.pixel);
    heights.push_back(place.height);
    greys.push_back(place.grey);
    moving.push_back(place.has_moving);
  }
  put<const std::uint32_t>(pixels);
  put<const float>(heights);
  put<const std::uint8_t>(greys);
  put<const std::uint8_t>(moving);

  const RunTiming& timing = summary.timing;
  std::vector<double> times = {timing.flush, timing.pipeline};
  for (const TimingRow& row : timing.rows) {
    times.push_back(static_cast<double>(row.points));
    times.push_back(row.total);
    times.insert(times.end(), row.stages.begin(), row.stages.end());
    times.push_back(row.pose_residual ? 1.0 : 0.0);
    times.push_back(row.pose_residual ? row.pose_residual->translation : 0.0);
    times.push_back(row.pose_residual ? row.pose_residual->rotation : 0.0);
  }
  put<const double>(times);

  constexpr std::uint32_t kBlocks = 4096;  // of a part
  std::vector<std::int32_t> indices;
  std::vector<std::uint32_t> ends;
  std::vector<float> xyz;
  for (std::uint32_t first = 0; first < map.block_count(); first += kBlocks) {
    indices.clear();
    ends.clear();
    xyz.clear();
    for (std::uint32_t block = first; block < std::min(first + kBlocks, map.block_count());
         ++block) {
      const auto begin_of_block = static_cast<std::ptrdiff_t>(xyz.size());
      map.visit_in_block(block, [&](float x, float y, float z) {
        xyz.insert(xyz.end(), {z, y, x});
      });
      // Blocks give their newest point first: in the other order, a map fills up as this one did.
      std::reverse(xyz.begin() + begin_of_block, xyz.end());
      const std::array<std::int32_t, 3> index = map.block_index(block);
      indices.insert(indices.end(), index.begin(), index.end());
      ends.push_back(static_cast<std::uint32_t>(xyz.size()));
    }
    put<const std::int32_t>(indices);
    put<const std::uint32_t>(ends);
    put<const float>(xyz);
  }
  put_number(begin);
  put_number(checksum_.value());
  file_.commit(AtomicFile::Sync::kLater);
}

ChunkFileReader::ChunkFileReader(std::filesystem::path file, const ChunkKey& key)
    : path_(std::move(file)), file_(path_, std::ios::binary) {
  std::error_code error;
  size_ = std::filesystem::file_size(path_, error);
  if (error || !file_) fail("cannot be opened");
  if (size_ < kHeader + kTrailer || size_ % kWord != 0) fail("is cut off");
  if (get_number() != kMagic) fail("is no result of a chunk");
  if (get_number() != kVersion) fail("has another version");
  if (get_number() != key.request) fail("belongs to another run");
  const std::uint64_t first = get_number();
  if (first != key.first || get_number() != key.scans) fail("belongs to another chunk");
  seek(size_ - kTrailer);
  summary_ = get_number();
  checksum_ = get_number();
  seek(kHeader);
}

void ChunkFileReader::fail(const std::string& reason) const {
  throw IoError(path_.string() + ": " + reason);
}

void ChunkFileReader::verify() {
  constexpr std::size_t kPart = std::size_t{1} << 20U;
  seek(0);
  std::vector<char> bytes;
  Checksum sum;
  for (std::uint64_t left = size_ - kWord; left > 0; left -= bytes.size()) {
    bytes.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, kPart)));
    read(bytes.data(), bytes.size());
    sum.add(bytes.data(), bytes.size());
  }
  if (sum.value() != checksum_) fail("does not have the bytes that were written");
  seek(kHeader);
}

void ChunkFileReader::read(void* data, std::size_t size) {
  if (!file_.read(static_cast<char*>(data), static_cast<std::streamsize>(size))) {
    fail("cannot be read");
  }
  position_ += size;
}

void ChunkFileReader::seek(std::uint64_t position) {
  file_.seekg(static_cast<std::streamoff>(position));
  position_ = position;
}

std::uint64_t ChunkFileReader::get_size() {
  const std::uint64_t size = get_number();
  if (size > size_) fail("has an array of " + std::to_string(size) + " bytes");
  return size;
}

std::uint64_t ChunkFileReader::get_number() {
  std::uint64_t value = 0;
  read(&value, sizeof(value));
  return value;
}

template <class T>
void ChunkFileReader::get(std::vector<T>& values) {
  const std::uint64_t size = get_size();
  if (size % sizeof(T) != 0) fail("has an array of " + std::to_string(size) + " bytes");
  values.resize(static_cast<std::size_t>(size / sizeof(T)));
  read(values.data(), static_cast<std::size_t>(size));
  const std::size_t rest = padded(static_cast<std::size_t>(size)) - static_cast<std::size_t>(size);
  std::array<char, kWord> zeros{};
  read(zeros.data(), rest);
}

void ChunkFileReader::next(ChunkScan& scan) {
  get_verdict(runs_, scan);
  runs_.expand(scan);
  get(scan.moving);
}

void ChunkFileReader::next_runs(VerdictRuns& runs, ChunkScan& scan) {
  get_verdict(runs, scan);
  const std::uint64_t size = get_size();
  seek(position_ + padded(static_cast<std::size_t>(size)));
}

void ChunkFileReader::next_moving(std::vector<char>& moving) {
  const std::uint64_t size = get_size();
  seek(position_ + size);
  get(moving);
}

void ChunkFileReader::get_verdict(VerdictRuns& runs, ChunkScan& scan) {
  get_size();
  get(runs.ends);
  get(runs.instances);
  get(runs.labels);
  get(runs.causes);
  if (!runs.is_valid()) fail("has other runs of points");
  get(scan.beliefs);
  get(scan.online);
}

ChunkSummary ChunkFileReader::read_summary() {
  seek(summary_);
  ChunkSummary summary;
  summary.points = get_number();
  std::vector<std::uint64_t> labels;
  get(labels);
  if (labels.size() != summary.labels.of.size()) fail("has other labels");
  std::copy(labels.begin(), labels.end(), summary.labels.of.begin());
  get(summary.instances.shared_before);
  get(summary.instances.shared_behind);
  get(summary.instances.still_before);
  get(summary.instances.moving_behind);
  summary.instances.last = static_cast<std::uint32_t>(get_number());
  std::vector<std::uint32_t> pixels;
  std::vector<float> heights;
  std::vector<std::uint8_t> greys, moving;
  get(pixels);
  get(heights);
  get(greys);
  get(moving);
  const std::size_t count = pixels.size();
  if (heights.size() != count || greys.size() != count || moving.size() != count) {
    fail("has another picture");
  }
  for (std::size_t i = 0; i < count; ++i) {
    summary.overview.push_back({pixels[i], heights[i], greys[i], moving[i]});
  }

  RunTiming& timing = summary.timing;
  timing.stages = stage_names();
  std::vector<double> times;
  get(times);
  const std::size_t columns = timing.stages.size() + 5;
  constexpr std::size_t kTotals = 2;
  if (times.size() < kTotals || (times.size() - kTotals) % columns != 0) fail("has other times");
  const double* value = times.data();
  timing.flush = *value++;
  timing.pipeline = *value++;
  while (value != times.data() + times.size()) {
    TimingRow row;
    row.points = static_cast<std::size_t>(*value++);
    row.total = *value++;
    row.stages.assign(value, value + timing.stages.size());
    value += timing.stages.size();
    if (*value != 0.0) {
      row.pose_residual.emplace();
      row.pose_residual->translation = value[1];
      row.pose_residual->rotation = value[2];
    }
    value += 3;
    timing.rows.push_back(std::move(row));
  }
  return summary;
}

void ChunkFileReader::add_map(StaticMapAccumulator& map) {
  std::vector<std::int32_t> indices;
  std::vector<std::uint32_t> ends;
  std::vector<float> xyz;
  while (position_ < size_ - kTrailer) {
    get(indices);
    get(ends);
    get(xyz);
    const bool fits = indices.size() == 3 * ends.size() &&
                      (ends.empty() ? 0 : ends.back()) == xyz.size() &&
                      std::is_sorted(ends.begin(), ends.end());
    if (!fits) fail("has another part of the map");
    std::size_t first = 0;
    for (std::size_t block = 0; block < ends.size(); ++block) {
      const std::int32_t* const index = indices.data() + 3 * block;
      map.insert_in_block({index[0], index[1], index[2]},
                          {xyz.data() + first, ends[block] - first});
      first = ends[block];
    }
  }
}

}  // namespace dynains::program
