// Memory in large pages, where the system gives them on request.
#pragma once

namespace dynains::program {

/// Lets buffers of the main thread lie in large pages: the first touch of each scan's buffers then
/// costs a fraction. To be called before these are made. Where the system (Linux with glibc) has no
/// large pages, or no room, nothing happens.
void prefer_large_pages();

}  // namespace dynains::program
