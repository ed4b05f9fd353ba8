#include "dynains/io/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <random>
#include <streambuf>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "failure.hpp"

namespace dynains {

/// Buffer of a stream to a new file. It keeps the error of a failed write and can write to the
/// disk; std::filebuf cannot.
class FileBuffer : public std::streambuf {
 public:
  explicit FileBuffer(const std::filesystem::path& path)
      : descriptor_(
            ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666)),
        error_(descriptor_ < 0 ? errno : 0),
        bytes_(std::size_t{1} << 16) {
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }
  ~FileBuffer() override { close(); }
  FileBuffer(const FileBuffer&) = delete;
  FileBuffer& operator=(const FileBuffer&) = delete;

  /// errno of the first failure, 0 if none.
  int error() const { return error_; }

  void sync_disk() {
    if (error_ != 0) return;
    // Without this, a power cut after the rename can leave an empty file under the final name.
    // Some file systems cannot sync single files (EINVAL); the rename is still atomic there.
    if (::fsync(descriptor_) != 0 && errno != EINVAL) error_ = errno;
  }

  /// Some file systems report a failed write only to close(). descriptor_ stays open.
  void check_close() {
    const int copy = ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0);
    if (copy >= 0 && ::close(copy) != 0 && error_ == 0) error_ = errno;
  }

  void close() {
    if (descriptor_ >= 0) ::close(descriptor_);
    descriptor_ = -1;
  }

 protected:
  int_type overflow(int_type c) override {
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  /// Writes an array that is larger than the buffer directly, without a copy.
  std::streamsize xsputn(const char* data, std::streamsize count) override {
    if (count < epptr() - pbase()) return std::streambuf::xsputn(data, count);
    return sync() == 0 && write_all(data, data + count) ? count : 0;
  }

  /// Absolute positions only: enough to complete a header at the end.
  pos_type seekpos(pos_type position, std::ios_base::openmode) override {
    if (sync() != 0 || ::lseek(descriptor_, position, SEEK_SET) < 0) return pos_type(off_type(-1));
    return position;
  }

  int sync() override {
    const bool is_written = write_all(pbase(), pptr());
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    return is_written ? 0 : -1;
  }

 private:
  bool write_all(const char* next, const char* end) {
    while (error_ == 0 && next != end) {
      const ssize_t count = ::write(descriptor_, next, static_cast<std::size_t>(end - next));
      if (count > 0) next += count;
      if (count < 0 && errno != EINTR) error_ = errno;
    }
    return error_ == 0;
  }

  int descriptor_;
  int error_;
  std::vector<char> bytes_;
};

namespace {

namespace fs = std::filesystem;

/// The file that will be replaced: renaming over a link would cut it off from its target.
fs::path follow_links(fs::path path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path resolved = fs::weakly_canonical(path, error);
  return error ? path : resolved;
}

constexpr std::string_view kHexDigits = "0123456789abcdef";
constexpr std::string_view kTemporaryEnd = ".tmp";
constexpr std::size_t kRandomDigits = 16;

std::string random_digits() {
  std::random_device random;
  std::string digits;
  while (digits.size() < kRandomDigits) digits += kHexDigits[random() % kHexDigits.size()];
  return digits;
}

/// A rename is on the disk when its folder is. Some file systems cannot sync folders (EINVAL), and
/// some folders cannot be opened; the file is whole either way.
void sync_folder(const fs::path& folder) {
  const int descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  if (error != 0 && error != EINVAL) fail_by_system(folder, "cannot be written to the disk", error);
}

}  // namespace

AtomicFile::AtomicFile(fs::path target)
    : target_(follow_links(std::move(target))), stream_(nullptr) {
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    fail(target_, "cannot be replaced: expected a regular file or none");
  }
  temporary_ = target_.parent_path() / ('.' + target_.filename().string() + '.' + random_digits() +
                                        std::string(kTemporaryEnd));
  buffer_ = std::make_unique<FileBuffer>(temporary_);
  if (buffer_->error() != 0) fail_by_system(target_, "cannot be written", buffer_->error());
  stream_.rdbuf(buffer_.get());
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::finish(Sync sync) {
  buffer_->pubsync();
  if (sync == Sync::kNow) buffer_->sync_disk();
  buffer_->check_close();
  if (buffer_->error() != 0)
    fail_by_system(target_, "cannot be written to the end", buffer_->error());
}

void AtomicFile::commit(Sync sync) {
  finish(sync);
  std::error_code error;
  fs::rename(temporary_, target_, error);
  if (error) fail_by_system(target_, "cannot be put in place", error.value());
  committed_ = true;
  buffer_->close();
  if (sync == Sync::kNow) sync_folder(target_.parent_path());
}

std::string target_of_temporary(const std::string& name) {
  const std::size_t end_size = 1 + kRandomDigits + kTemporaryEnd.size();
  if (name.size() < end_size + 2 || name.front() != '.') return {};
  const std::size_t point = name.size() - end_size;
  const std::string_view digits = std::string_view(name).substr(point + 1, kRandomDigits);
  const bool is_temporary =
      name[point] == '.' &&
      name.compare(point + 1 + kRandomDigits, name.npos, kTemporaryEnd) == 0 &&
      digits.find_first_not_of(kHexDigits) == digits.npos;
  return is_temporary ? name.substr(1, point - 1) : std::string();
}

void sync_files(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) fail_by_system(folder, "cannot be written to the disk", errno);
  const int result = ::syncfs(descriptor);
  const int error = errno;
  ::close(descriptor);
  if (result != 0) fail_by_system(folder, "cannot be written to the disk", error);
}

}  // namespace dynains
