// What a stranger would write first: a few scans through the package, and a look at the answer.
#include <cstdio>

#include "dynains/parameters.hpp"
#include "dynains/points.hpp"
#include "dynains/version.hpp"

namespace {

struct Settings {
  double resolution = 0.1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& visitor) {
    visitor(dynains::Parameter{"resolution", self.resolution, dynains::open(0.0, 1.0), "m", ""});
  }
};

bool refuses(double resolution) {
  try {
    dynains::validate_parameters("Settings", Settings{resolution});
  } catch (const dynains::ConfigError&) {
    return true;
  }
  return false;
}

}  // namespace

int main() {
  dynains::PointBuffer points;
  points.push_back(1.0F, 2.0F, 3.0F);
  const dynains::PointsView view = points;
  const bool works = view.size() == 1 && view.y[0] == 2.0F && refuses(2.0) && !refuses(0.5);
  std::printf("dynains %s: %s\n", dynains::kVersionString, works ? "works" : "fails");
  return works ? 0 : 1;
}
