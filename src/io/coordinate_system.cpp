#include "dynains/io/coordinate_system.hpp"

#include <memory>

#include "dynains/errors.hpp"

#if defined(DYNAINS_HAS_PROJ)
#include <proj.h>
#endif

namespace dynains {

#if defined(DYNAINS_HAS_PROJ)

std::string wkt_of(const std::string& name) {
  const std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context(proj_context_create(),
                                                                             proj_context_destroy);
  proj_log_level(context.get(), PJ_LOG_NONE);
  const std::unique_ptr<PJ, decltype(&proj_destroy)> system(
      proj_create(context.get(), name.c_str()), proj_destroy);
  const char* wkt = nullptr;
  if (system && proj_is_crs(system.get()) != 0) {
    const char* const options[] = {"MULTILINE=NO", nullptr};
    wkt = proj_as_wkt(context.get(), system.get(), PJ_WKT1_GDAL, options);
  }
  if (wkt == nullptr) {
    throw ConfigError("expected a coordinate reference system such as EPSG:25832, found " + name);
  }
  return wkt;
}

#else

std::string wkt_of(const std::string&) {
  throw ConfigError(
      "this build has no PROJ, which coordinate reference systems need (Debian: "
      "libproj-dev)");
}

#endif

}  // namespace dynains
