// Reader of ZIP archives, for .npz.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "log/bytes.hpp"
#include "log/raw_file.hpp"

namespace dynains {

/// The files of an archive, stored or deflated (needs zlib), also with sizes of 64 bits. All
/// members throw IoError.
class ZipArchive {
 public:
  struct Member {
    std::string name;
    std::uint16_t method = 0;  ///< 0: stored, 8: deflated
    std::uint32_t crc = 0;
    std::uint64_t compressed_size = 0;
    std::uint64_t size = 0;      ///< as announced
    std::uint64_t position = 0;  ///< of its local header
  };

  explicit ZipArchive(const std::filesystem::path& path);

  const std::vector<Member>& members() const { return members_; }
  /// Replaces `content` by the bytes of the member, which are compared with its checksum.
  void read(const Member& member, std::vector<std::uint8_t>& content);

 private:
  struct Directory {
    std::uint64_t position = 0;
    std::uint64_t size = 0;
    std::uint64_t members = 0;
  };

  Directory find_directory();
  void read_large_directory(std::uint64_t end, Directory& directory);
  Member read_member(Bytes& fields) const;

  RawFile file_;
  std::vector<Member> members_;
};

}  // namespace dynains
