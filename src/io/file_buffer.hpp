// Buffer of an output stream to a file, with the error of a failed write.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <streambuf>
#include <vector>

namespace dynains {

/// Buffer of a stream to an open file, which it owns. It keeps the error of a failed write and can
/// write to the disk; std::filebuf cannot.
class FileBuffer : public std::streambuf {
 public:
  /// `descriptor`: what open() returned. After a failure of open(), error() is its errno.
  explicit FileBuffer(int descriptor)
      : descriptor_(descriptor), error_(descriptor < 0 ? errno : 0), bytes_(std::size_t{1} << 16) {
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

  /// Some file systems report a failed write only to close(). The lock stays with descriptor_.
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

}  // namespace dynains
