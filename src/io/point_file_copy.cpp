#include "point_file_copy.hpp"

#include "byte_reader.hpp"
#include "failure.hpp"
#include "text.hpp"

namespace dynains {

void copy_points(const std::filesystem::path& path, Span<const std::uint8_t> keep,
                 std::ostream& target) {
  const std::string extension = text::lower_case(path.extension().string());
  if (extension == ".ply") return copy_ply(path, keep, target);
  if (extension == ".pcd") return copy_pcd(path, keep, target);
  fail(path, "expected a name that ends in .ply or .pcd");
}

void copy_lines(const std::filesystem::path& path, std::uint64_t size, std::ostream& target,
                const std::function<std::string(const std::string&)>& edit) {
  ByteReader reader(path);
  std::string line;
  while (reader.position() < size && reader.read_line(line)) target << edit(line) << '\n';
}

}  // namespace dynains
