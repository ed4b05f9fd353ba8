#include "dynains/io/coordinate_system.hpp"

#include <memory>

#include "dynains/errors.hpp"

#if defined(DYNAINS_HAS_PROJ)
#include <dlfcn.h>
#include <proj.h>
#endif

namespace dynains {

#if defined(DYNAINS_HAS_PROJ)

namespace {

/// PROJ, loaded when a name is looked up. It needs 40 further libraries, which would take two
/// thirds of the time in which a program starts.
class Proj {
 public:
  Proj() : library_(::dlopen(DYNAINS_PROJ_FILE, RTLD_NOW)) {
    if (library_ == nullptr) {
      throw ConfigError(std::string("PROJ, which coordinate reference systems need, cannot be "
                                    "loaded (Debian: libproj-dev): ") +
                        ::dlerror());
    }
  }
  ~Proj() { ::dlclose(library_); }
  Proj(const Proj&) = delete;
  Proj& operator=(const Proj&) = delete;

  template <class Function>
  Function* function(const char* name) const {
    auto* const found = reinterpret_cast<Function*>(::dlsym(library_, name));
    if (found == nullptr) throw ConfigError(std::string("PROJ lacks ") + name);
    return found;
  }

 private:
  void* library_;
};

}  // namespace

std::string wkt_of(const std::string& name) {
  const Proj proj;
  const auto is_system = proj.function<decltype(proj_is_crs)>("proj_is_crs");
  const auto as_wkt = proj.function<decltype(proj_as_wkt)>("proj_as_wkt");
  const std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context(
      proj.function<decltype(proj_context_create)>("proj_context_create")(),
      proj.function<decltype(proj_context_destroy)>("proj_context_destroy"));
  proj.function<decltype(proj_log_level)>("proj_log_level")(context.get(), PJ_LOG_NONE);
  const std::unique_ptr<PJ, decltype(&proj_destroy)> system(
      proj.function<decltype(proj_create)>("proj_create")(context.get(), name.c_str()),
      proj.function<decltype(proj_destroy)>("proj_destroy"));
  const char* wkt = nullptr;
  if (system && is_system(system.get()) != 0) {
    const char* const options[] = {"MULTILINE=NO", nullptr};
    wkt = as_wkt(context.get(), system.get(), PJ_WKT1_GDAL, options);
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
