#include "large_pages.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>

#if defined(__linux__) && defined(__GLIBC__)

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

namespace dynains::program {

void prefer_large_pages() {
  constexpr std::size_t kPage = std::size_t{1} << 21;
  constexpr int kRoom = 1 << 30;           // bytes of addresses; memory is taken as it is touched
  constexpr int kLargestInHeap = 1 << 25;  // bytes; the most that glibc allows
  constexpr int kUsualPad = 1 << 17;       // bytes; glibc's own
  mallopt(M_ARENA_MAX, 1);                 // the thread that reads ahead takes from the same heap
  mallopt(M_MMAP_THRESHOLD, kLargestInHeap);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  // One block makes the heap grow by all of the room, which is asked for as large pages.
  mallopt(M_TOP_PAD, kRoom);
  void* const block = std::malloc(kPage);
  mallopt(M_TOP_PAD, kUsualPad);
  const auto begin = (reinterpret_cast<std::uintptr_t>(block) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(sbrk(0)) / kPage * kPage;
  if (block != nullptr && begin < end) {
    madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
  }
  std::free(block);
}

}  // namespace dynains::program

#else

namespace dynains::program {

void prefer_large_pages() {}

}  // namespace dynains::program

#endif
