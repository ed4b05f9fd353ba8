// Memory in large pages, where the system gives them on request.
#pragma once

namespace dynains::program {

/// Lets buffers lie in large pages: the first touch of each scan's buffers then costs a fraction. To
/// be called before these are made, and before threads are started. Where the system (Linux with glibc) has no
/// large pages, or no room, nothing happens.
void prefer_large_pages();

}  // namespace dynains::program
