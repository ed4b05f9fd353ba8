#include "dynains/io/atomic_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <streambuf>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "failure.hpp"

namespace dynains {
namespace {

namespace fs = std::filesystem;

/// The file that will be replaced: renaming over a link would cut it off from its target.
fs::path follow_links(fs::path path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  fs::path resolved = fs::weakly_canonical(path, error);
  return error ? path : resolved;
}

/// A rename is on the disk when its folder is. Where folders cannot be synced (EINVAL), or not be
/// opened, the file is whole either way.
void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

/// std::filebuf hides why a write failed and cannot sync; this one knows its descriptor.
class AtomicFile::Buffer : public std::streambuf {
 public:
  explicit Buffer(const fs::path& path)
      : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)),
        bytes_(std::size_t{1} << 16) {
    if (descriptor_ < 0) error_ = errno;
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }
  ~Buffer() override { close(); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  /// errno of the first failure, 0 if none.
  int error() const { return error_; }

  void flush(Sync when) {
    if (sync() != 0 || when == Sync::kLater) return;
    // Without this, a power cut after the rename can leave an empty file under the final name.
    // Some file systems cannot sync single files (EINVAL); the rename is still atomic there.
    if (::fsync(descriptor_) != 0 && errno != EINVAL) error_ = errno;
  }

  void close() {
    if (descriptor_ >= 0 && ::close(descriptor_) != 0 && error_ == 0) error_ = errno;
    descriptor_ = -1;
  }

 protected:
  int_type overflow(int_type c) override {
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  /// Absolute positions only: enough to complete a header at the end.
  pos_type seekpos(pos_type position, std::ios_base::openmode) override {
    if (sync() != 0 || ::lseek(descriptor_, position, SEEK_SET) < 0) return pos_type(off_type(-1));
    return position;
  }

  int sync() override {
    const char* next = pbase();
    while (error_ == 0 && next != pptr()) {
      const ssize_t count = ::write(descriptor_, next, static_cast<std::size_t>(pptr() - next));
      if (count > 0) next += count;
      if (count < 0 && errno != EINTR) error_ = errno;
    }
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    return error_ == 0 ? 0 : -1;
  }

 private:
  int descriptor_;
  int error_ = 0;
  std::vector<char> bytes_;
};

AtomicFile::AtomicFile(fs::path target)
    : target_(follow_links(std::move(target))), temporary_(target_), stream_(nullptr) {
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    fail(target_, "cannot be replaced: expected a regular file or none");
  }
  temporary_.replace_filename("." + target_.filename().string() + "." + std::to_string(::getpid()) +
                              ".tmp");
  buffer_ = std::make_unique<Buffer>(temporary_);
  if (buffer_->error() != 0) fail_by_system(target_, "cannot be written", buffer_->error());
  stream_.rdbuf(buffer_.get());
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  buffer_->close();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void AtomicFile::commit(Sync sync) {
  buffer_->flush(sync);
  buffer_->close();
  if (buffer_->error() != 0)
    fail_by_system(target_, "cannot be written to the end", buffer_->error());
  std::error_code error;
  fs::rename(temporary_, target_, error);
  if (error) fail_by_system(target_, "cannot be put in place", error.value());
  committed_ = true;
  if (sync == Sync::kNow) sync_folder(target_.parent_path());
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
