// Preloaded into a program (LD_PRELOAD, glibc), intercepts the calls by which `dynains` touches
// files. The test of power cuts finds changes of files by other calls.
//
// DYNAINS_SHIM_ROOT  folder: calls on paths outside it are not intercepted
// DYNAINS_SHIM_LOG   file: every change below the root is appended, in one order for all threads
// DYNAINS_SHIM_FAULT "CALL N ERRNO once|on": the Nth CALL below the root fails, or it and all later
//                    ones. ERRNO 0 means that read and write move half the bytes. CALL is open,
//                    read, write, sync, rename, remove, mkdir, stat, list, lock or close.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "log.hpp"

namespace {

namespace fs = std::filesystem;
using dynains::shim::Entry;
using dynains::shim::Event;

/// The function of this name that the shim hides.
template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

std::string environment(const char* name) {
  const char* const value = ::getenv(name);
  return value == nullptr ? std::string() : value;
}

/// Treatment of a call.
enum class Fate { kPass, kFail, kHalf };

class Shim {
 public:
  Shim() : root_(environment("DYNAINS_SHIM_ROOT")) {
    const std::string log = environment("DYNAINS_SHIM_LOG");
    const int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;
    if (!log.empty()) {
      const int low = next<int(const char*, int, ...)>("open")(log.c_str(), flags, 0600);
      log_ = ::fcntl(low, F_DUPFD_CLOEXEC, 500);  // descriptors of the program are unchanged
      next<int(int)>("close")(low);
    }
    char call[16] = {};
    char how[16] = {};
    const std::string fault = environment("DYNAINS_SHIM_FAULT");
    if (::sscanf(fault.c_str(), "%15s %ld %d %15s", call, &countdown_, &error_, how) == 4) {
      failing_call_ = call;
      stays_ = std::strcmp(how, "on") == 0;
    }
  }

  /// The whole path if it is the root or lies below it; else empty.
  std::string below_root(int folder, const char* path) const {
    if (root_.empty() || path == nullptr) return {};
    fs::path whole = path;
    if (whole.is_relative()) whole = path_of_folder(folder) / whole;
    whole = whole.lexically_normal();
    if (!whole.has_filename()) whole = whole.parent_path();
    const std::string& text = whole.native();
    const bool below = text.compare(0, root_.size(), root_) == 0 &&
                       (text.size() == root_.size() || text[root_.size()] == '/');
    return below ? text : std::string();
  }

  /// The path that the descriptor was opened by if it is below the root, else empty.
  std::string below_root(int descriptor) const {
    const auto found = open_.find(descriptor);
    return found == open_.end() ? std::string() : found->second;
  }

  Fate fate(const char* call, const std::string& path) {
    if (path.empty() || failing_call_ != call) return Fate::kPass;
    --countdown_;
    if (countdown_ != 0 && !(stays_ && countdown_ < 0)) return Fate::kPass;
    record({Event::kFault, -1, error_, path, call});
    errno = error_;
    return error_ == 0 ? Fate::kHalf : Fate::kFail;
  }
  bool fails(const char* call, const std::string& path) { return fate(call, path) == Fate::kFail; }

  void record(const Entry& entry) {
    if (log_ < 0) return;
    const std::string bytes = to_bytes(entry);
    const ssize_t written = next<ssize_t(int, const void*, size_t)>("write")(  //
        log_, bytes.data(), bytes.size());
    if (written != static_cast<ssize_t>(bytes.size())) ::abort();
  }

  void opened(int descriptor, const std::string& path, int flags) {
    closed(descriptor);
    if (path.empty()) return;
    open_[descriptor] = path;
    record({Event::kOpen, descriptor, flags, path, {}});
  }
  void closed(int descriptor) {
    open_.erase(descriptor);
    listed_.erase(descriptor);
  }

  /// Whether this is the first readdir of the descriptor: only this one calls the system.
  bool is_first_entry(int descriptor) { return listed_.insert(descriptor).second; }

 private:
  static fs::path path_of_folder(int descriptor) {
    char path[4096] = {};
    if (descriptor == AT_FDCWD) return ::getcwd(path, sizeof(path)) == nullptr ? "" : path;
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    return ::readlink(link.c_str(), path, sizeof(path) - 1) < 0 ? "" : path;
  }

  std::string root_;
  int log_ = -1;
  std::string failing_call_;
  long countdown_ = 0;
  int error_ = 0;
  bool stays_ = false;
  std::map<int, std::string> open_;
  std::set<int> listed_;
};

/// Never destroyed: the program may close files until its very end.
Shim& shim() {
  static Shim* const instance = new Shim;
  return *instance;
}

/// Held while a call is made and recorded, so that the log has one order.
std::unique_lock<std::mutex> lock() {
  static std::mutex* const mutex = new std::mutex;
  return std::unique_lock<std::mutex>(*mutex);
}

int open_file(int folder, const char* path, int flags, mode_t mode) {
  const auto held = lock();
  const std::string whole = shim().below_root(folder, path);
  if (shim().fails("open", whole)) return -1;
  const int descriptor = next<int(int, const char*, int, ...)>("openat")(folder, path, flags, mode);
  if (descriptor >= 0) shim().opened(descriptor, whole, flags);
  return descriptor;
}

FILE* open_stream(const char* path, const char* mode) {
  const auto held = lock();
  const std::string whole = shim().below_root(AT_FDCWD, path);
  if (shim().fails("open", whole)) return nullptr;
  FILE* const stream = next<FILE*(const char*, const char*)>("fopen64")(path, mode);
  if (stream == nullptr) return nullptr;
  const bool writes = mode[0] == 'w';
  shim().opened(::fileno(stream), whole, writes ? O_WRONLY | O_CREAT | O_TRUNC : O_RDONLY);
  return stream;
}

/// Makes the call with all bytes, with half of them, or not at all. Records the written bytes.
ssize_t write_bytes(int descriptor, const char* data, size_t size) {
  const auto held = lock();
  const off_t offset = ::lseek(descriptor, 0, SEEK_CUR);
  const std::string whole = shim().below_root(descriptor);
  const Fate fate = shim().fate("write", whole);
  if (fate == Fate::kFail) return -1;
  const ssize_t written = next<ssize_t(int, const void*, size_t)>("write")(
      descriptor, data, fate == Fate::kHalf ? (size + 1) / 2 : size);
  if (written > 0 && !whole.empty()) {
    shim().record({Event::kWrite, descriptor, offset, whole,
                   std::string(data, static_cast<size_t>(written))});
  }
  return written;
}

int sync_file(const char* name, int descriptor, Event event) {
  const auto held = lock();
  const std::string whole = shim().below_root(descriptor);
  if (shim().fails("sync", whole)) return -1;
  const int result = next<int(int)>(name)(descriptor);
  if (result == 0 && !whole.empty()) shim().record({event, descriptor, 0, whole, {}});
  return result;
}

int rename_path(int from_folder, const char* from, int to_folder, const char* to,
                unsigned int flags) {
  const auto held = lock();
  const std::string whole = shim().below_root(from_folder, from);
  if (shim().fails("rename", whole)) return -1;
  const int result = next<int(int, const char*, int, const char*, unsigned int)>("renameat2")(
      from_folder, from, to_folder, to, flags);
  const Event event = (flags & RENAME_EXCHANGE) != 0 ? Event::kExchange : Event::kRename;
  if (result == 0) shim().record({event, -1, 0, whole, shim().below_root(to_folder, to)});
  return result;
}

int remove_path(int folder, const char* path, int flags) {
  const auto held = lock();
  const std::string whole = shim().below_root(folder, path);
  if (shim().fails("remove", whole)) return -1;
  const int result = next<int(int, const char*, int)>("unlinkat")(folder, path, flags);
  if (result == 0 && !whole.empty()) shim().record({Event::kRemove, -1, 0, whole, {}});
  return result;
}

int make_folder(int folder, const char* path, mode_t mode) {
  const auto held = lock();
  const std::string whole = shim().below_root(folder, path);
  if (shim().fails("mkdir", whole)) return -1;
  const int result = next<int(int, const char*, mode_t)>("mkdirat")(folder, path, mode);
  if (result == 0 && !whole.empty()) shim().record({Event::kMakeFolder, -1, 0, whole, {}});
  return result;
}

template <class Status>
int status_of(const char* name, int folder, const char* path, Status* status, int flags) {
  const auto held = lock();
  if (shim().fails("stat", shim().below_root(folder, path))) return -1;
  return next<int(int, const char*, Status*, int)>(name)(folder, path, status, flags);
}

template <class Item>
Item* next_item(const char* name, DIR* folder) {
  const auto held = lock();
  const int descriptor = ::dirfd(folder);
  if (shim().is_first_entry(descriptor) && shim().fails("list", shim().below_root(descriptor))) {
    return nullptr;
  }
  return next<Item*(DIR*)>(name)(folder);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const auto mode = static_cast<mode_t>(va_arg(more, int));
  va_end(more);
  return open_file(AT_FDCWD, path, flags, mode);
}
int open64(const char*, int, ...) __attribute__((alias("open")));
int openat(int folder, const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const auto mode = static_cast<mode_t>(va_arg(more, int));
  va_end(more);
  return open_file(folder, path, flags, mode);
}
int openat64(int, const char*, int, ...) __attribute__((alias("openat")));
FILE* fopen(const char* path, const char* mode) { return open_stream(path, mode); }
FILE* fopen64(const char* path, const char* mode) { return open_stream(path, mode); }

ssize_t write(int descriptor, const void* data, size_t size) {
  return write_bytes(descriptor, static_cast<const char*>(data), size);
}
ssize_t writev(int descriptor, const iovec* parts, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) {
    bytes.append(static_cast<const char*>(parts[i].iov_base), parts[i].iov_len);
  }
  return write_bytes(descriptor, bytes.data(), bytes.size());
}
ssize_t read(int descriptor, void* data, size_t size) {
  const auto held = lock();
  const Fate fate = shim().fate("read", shim().below_root(descriptor));
  if (fate == Fate::kFail) return -1;
  if (fate == Fate::kHalf) size = (size + 1) / 2;
  return next<ssize_t(int, void*, size_t)>("read")(descriptor, data, size);
}

int fsync(int descriptor) { return sync_file("fsync", descriptor, Event::kSync); }
int syncfs(int descriptor) noexcept { return sync_file("syncfs", descriptor, Event::kSyncAll); }
int rename(const char* from, const char* to) noexcept {
  return rename_path(AT_FDCWD, from, AT_FDCWD, to, 0);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned int flags) noexcept {
  return rename_path(from_folder, from, to_folder, to, flags);
}
int unlink(const char* path) noexcept { return remove_path(AT_FDCWD, path, 0); }
int unlinkat(int folder, const char* path, int flags) noexcept {
  return remove_path(folder, path, flags);
}
int rmdir(const char* path) noexcept { return remove_path(AT_FDCWD, path, AT_REMOVEDIR); }
int remove(const char* path) noexcept {
  const int result = unlink(path);
  return result != 0 && errno == EISDIR ? rmdir(path) : result;
}
int mkdir(const char* path, mode_t mode) noexcept { return make_folder(AT_FDCWD, path, mode); }
int mkdirat(int folder, const char* path, mode_t mode) noexcept {
  return make_folder(folder, path, mode);
}

int stat(const char* path, struct stat* status) noexcept {
  return status_of("fstatat", AT_FDCWD, path, status, 0);
}
int stat64(const char* path, struct stat64* status) noexcept {
  return status_of("fstatat64", AT_FDCWD, path, status, 0);
}
int lstat(const char* path, struct stat* status) noexcept {
  return status_of("fstatat", AT_FDCWD, path, status, AT_SYMLINK_NOFOLLOW);
}
int lstat64(const char* path, struct stat64* status) noexcept {
  return status_of("fstatat64", AT_FDCWD, path, status, AT_SYMLINK_NOFOLLOW);
}
int fstatat(int folder, const char* path, struct stat* status, int flags) noexcept {
  return status_of("fstatat", folder, path, status, flags);
}

dirent* readdir(DIR* folder) { return next_item<dirent>("readdir", folder); }
dirent64* readdir64(DIR* folder) { return next_item<dirent64>("readdir64", folder); }
int flock(int descriptor, int operation) noexcept {
  const auto held = lock();
  if (shim().fails("lock", shim().below_root(descriptor))) return -1;
  return next<int(int, int)>("flock")(descriptor, operation);
}

int close(int descriptor) {
  const auto held = lock();
  const std::string whole = shim().below_root(descriptor);
  shim().closed(descriptor);
  const int result = next<int(int)>("close")(descriptor);
  return shim().fails("close", whole) ? -1 : result;
}
int fclose(FILE* stream) {
  const auto held = lock();
  shim().closed(::fileno(stream));
  return next<int(FILE*)>("fclose")(stream);
}
int closedir(DIR* folder) {
  const auto held = lock();
  shim().closed(::dirfd(folder));
  return next<int(DIR*)>("closedir")(folder);
}

}  // extern "C"
