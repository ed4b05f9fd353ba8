#include "dynains/recording/byte_store.hpp"

#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "dynains/errors.hpp"

namespace dynains {
namespace {

[[noreturn]] void fail(const std::filesystem::path& folder, bool reads, int error) {
  throw IoError(
      folder.string() +
      (reads ? ": what waits there cannot be read: " : ": cannot hold what waits there: ") +
      std::generic_category().message(error));
}

/// Some file systems cannot make a file without a name: it gets one for a moment.
int open_without_name(const std::filesystem::path& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string name = (folder / ".byte_store.XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

ByteStore::ByteStore(std::filesystem::path folder)
    : folder_(std::move(folder)), file_(open_without_name(folder_)) {
  if (file_ < 0) fail(folder_, false, errno);
}

ByteStore::~ByteStore() {
  if (file_ >= 0) ::close(file_);
}

std::uint64_t ByteStore::append(Span<const std::uint8_t> bytes) {
  const std::uint64_t offset = size_;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written = ::write(file_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(folder_, false, written < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(written);
  }
  size_ += bytes.size();
  return offset;
}

void ByteStore::read(std::uint64_t offset, std::size_t size,
                     std::vector<std::uint8_t>& bytes) const {
  bytes.resize(size);
  for (std::size_t done = 0; done < size;) {
    const ssize_t got =
        ::pread(file_, bytes.data() + done, size - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail(folder_, true, got < 0 ? errno : EIO);
    done += static_cast<std::size_t>(got);
  }
}

}  // namespace dynains
