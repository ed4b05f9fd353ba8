#include "zip_archive.hpp"

#include <algorithm>

#include "failure.hpp"
#include "log/decompress.hpp"

namespace dynains {
namespace {

constexpr std::uint32_t kDirectoryEnd = 0x06054B50;
constexpr std::uint32_t kLargeDirectoryEnd = 0x06064B50;
constexpr std::uint32_t kLargeDirectoryPlace = 0x07064B50;
constexpr std::uint32_t kDirectoryMember = 0x02014B50;
constexpr std::uint32_t kLocalMember = 0x04034B50;
constexpr std::uint64_t kDirectoryEndSize = 22;  // bytes, without a comment
constexpr std::uint64_t kLargeDirectoryPlaceSize = 20;
constexpr std::uint32_t kIsLarge = 0xFFFFFFFF;  // the size stands in an extra field

}  // namespace

ZipArchive::ZipArchive(const std::filesystem::path& path) : file_(path) {
  const Directory directory = find_directory();
  const auto content = file_.read(directory.position, directory.size, "the list of members");
  Bytes fields(file_.path(), directory.position, content.data(), content.size());
  for (std::uint64_t i = 0; i < directory.members; ++i) members_.push_back(read_member(fields));
}

/// The end of the list of members is the last record; a comment of at most 65535 bytes may follow.
ZipArchive::Directory ZipArchive::find_directory() {
  const std::uint64_t searched = std::min<std::uint64_t>(file_.size(), kDirectoryEndSize + 0xFFFF);
  const std::uint64_t begin = file_.size() - searched;
  const auto tail = file_.read(begin, searched, "the end of the archive");
  for (std::uint64_t i = searched >= kDirectoryEndSize ? searched - kDirectoryEndSize + 1 : 0;
       i-- > 0;) {
    Bytes fields(file_.path(), begin + i, tail.data() + i, tail.size() - i);
    if (fields.number<std::uint32_t>("a signature") != kDirectoryEnd) continue;
    fields.skip(6, "numbers of disks");
    Directory directory;
    directory.members = fields.number<std::uint16_t>("the number of members");
    directory.size = fields.number<std::uint32_t>("the size of the list of members");
    directory.position = fields.number<std::uint32_t>("the place of the list of members");
    if (directory.position == kIsLarge) read_large_directory(begin + i, directory);
    return directory;
  }
  fail_at_byte(file_.path(), file_.size(), "expected the end of a ZIP archive");
}

void ZipArchive::read_large_directory(std::uint64_t end, Directory& directory) {
  const std::uint64_t position = end - std::min(end, kLargeDirectoryPlaceSize);
  const auto place = file_.read(position, kLargeDirectoryPlaceSize, "the end of the archive");
  Bytes fields(file_.path(), position, place.data(), place.size());
  if (fields.number<std::uint32_t>("a signature") != kLargeDirectoryPlace) {
    fields.fail("expected the place of a list of members with sizes of 64 bits");
  }
  fields.skip(4, "a number of a disk");
  const auto record = fields.number<std::uint64_t>("the place of the list of members");
  const auto bytes = file_.read(record, 56, "the end of the archive");
  Bytes large(file_.path(), record, bytes.data(), bytes.size());
  if (large.number<std::uint32_t>("a signature") != kLargeDirectoryEnd) {
    large.fail("expected the end of a list of members with sizes of 64 bits");
  }
  large.skip(28, "versions and disks");
  directory.members = large.number<std::uint64_t>("the number of members");
  directory.size = large.number<std::uint64_t>("the size of the list of members");
  directory.position = large.number<std::uint64_t>("the place of the list of members");
}

ZipArchive::Member ZipArchive::read_member(Bytes& fields) const {
  if (fields.number<std::uint32_t>("a member") != kDirectoryMember) {
    fields.fail("expected a member of the archive");
  }
  Member member;
  fields.skip(6, "versions and flags");
  member.method = fields.number<std::uint16_t>("a method");
  fields.skip(4, "a time");
  member.crc = fields.number<std::uint32_t>("a checksum");
  member.compressed_size = fields.number<std::uint32_t>("a size");
  member.size = fields.number<std::uint32_t>("a size");
  const auto name_size = fields.number<std::uint16_t>("the length of a name");
  const auto extra_size = fields.number<std::uint16_t>("the length of extra fields");
  const auto comment_size = fields.number<std::uint16_t>("the length of a comment");
  fields.skip(8, "attributes");
  member.position = fields.number<std::uint32_t>("the place of a member");
  member.name = fields.block(name_size, "a name").rest_as_text();
  Bytes extra = fields.block(extra_size, "extra fields");
  fields.skip(comment_size, "a comment");
  while (extra.remaining() >= 4) {
    const auto id = extra.number<std::uint16_t>("an extra field");
    Bytes large = extra.block(extra.number<std::uint16_t>("a length"), "an extra field");
    constexpr std::uint16_t kLargeSizes = 1;
    if (id != kLargeSizes) continue;
    for (std::uint64_t* value : {&member.size, &member.compressed_size, &member.position}) {
      if (*value == kIsLarge) *value = large.number<std::uint64_t>("a size of 64 bits");
    }
  }
  return member;
}

void ZipArchive::read(const Member& member, std::vector<std::uint8_t>& content) {
  constexpr std::uint64_t kLocalSize = 30;  // bytes, of a local header without its texts
  const auto head = file_.read(member.position, kLocalSize, "a member");
  Bytes fields(file_.path(), member.position, head.data(), head.size());
  if (fields.number<std::uint32_t>("a member") != kLocalMember) fields.fail("expected a member");
  fields.skip(22, "the header of a member");
  const std::uint64_t texts = std::uint64_t{fields.number<std::uint16_t>("the length of a name")} +
                              fields.number<std::uint16_t>("the length of extra fields");
  const std::uint64_t begin = member.position + kLocalSize + texts;
  file_.read(begin, member.compressed_size, "a member", content);
  constexpr std::uint16_t kDeflated = 8;
  if (member.method == kDeflated) {
    const std::vector<std::uint8_t> compressed = std::move(content);
    const std::string obstacle = decompress("deflate", compressed, member.size, content);
    if (!obstacle.empty()) fail_at_byte(file_.path(), begin, member.name + ": " + obstacle);
  } else if (member.method != 0) {
    fail_at_byte(file_.path(), begin,
                 member.name + ": expected a stored or deflated member, found method " +
                     std::to_string(member.method));
  }
  if (content.size() != member.size ||
      (has_crc32() && crc32(content.data(), content.size()) != member.crc)) {
    fail_at_byte(file_.path(), begin,
                 member.name + ": expected the size and the checksum of the member");
  }
}

}  // namespace dynains
