#include "point_file_copy.hpp"

#include <algorithm>

#include "../byte_reader.hpp"
#include "../failure.hpp"
#include "../text.hpp"

namespace dynains {

void copy_points(const std::filesystem::path& path, Span<const std::uint8_t> keep,
                 std::ostream& target) {
  const std::string extension = text::lower_case(path.extension().string());
  if (extension == ".ply") return copy_ply(path, keep, target);
  if (extension == ".pcd") return copy_pcd(path, keep, target);
  if (extension != ".bin") fail(path, "expected a name that ends in .ply, .pcd or .bin");
  ByteReader reader(path);
  const std::uint64_t points = std::max<std::uint64_t>(keep.size(), 1);
  copy_records(reader, static_cast<std::size_t>(reader.remaining() / points), "a point", keep,
               target);
}

void copy_lines(const std::filesystem::path& path, std::uint64_t size, std::ostream& target,
                const std::function<std::string(const std::string&)>& edit) {
  ByteReader reader(path);
  std::string line;
  while (reader.position() < size && reader.read_line(line)) target << edit(line) << '\n';
}

void copy_records(ByteReader& reader, std::size_t size, const char* record,
                  Span<const std::uint8_t> keep, std::ostream& target) {
  std::string bytes(size, '\0');
  for (const std::uint8_t is_kept : keep) {
    if (size > 0) {
      reader.read(bytes.data(), size, record);
    } else if (!reader.read_line(bytes)) {
      reader.fail_on_line(std::string("file ends, expected ") + record);
    }
    if (is_kept == 0) continue;
    target << bytes;
    if (size == 0) target << '\n';
  }
}

std::size_t kept_count(Span<const std::uint8_t> keep) {
  return static_cast<std::size_t>(
      std::count_if(keep.begin(), keep.end(), [](auto value) { return value != 0; }));
}

}  // namespace dynains
