// Coordinate reference systems by name.
#pragma once

#include <string>

namespace dynains {

/// The text (WKT, as in OGC 01-009) of a coordinate reference system such as "EPSG:25832". Throws
/// ConfigError if its name is not known to PROJ, and if this build has no PROJ; the message then
/// names the Debian package.
std::string wkt_of(const std::string& name);

}  // namespace dynains
