#include <cmath>

#include "simulation/materials.hpp"
#include "simulation/model_parts.hpp"
#include "simulation/models.hpp"

namespace dynains::simulation {

Model bicycle_model() {
  const Material& frame = kMaterials.bicycle_frame;
  return {wheel(kMaterials.metal, -0.52, 0, 0.34, 0.03),
          wheel(kMaterials.metal, 0.52, 0, 0.34, 0.03),
          block(frame, -0.35, 0.4, -0.02, 0.02, 0.58, 0.62),
          block(frame, -0.02, 0.02, -0.02, 0.02, 0.3, 0.9),
          block(frame, -0.15, 0.1, -0.08, 0.08, 0.88, 0.95),
          block(frame, 0.4, 0.44, -0.28, 0.28, 0.98, 1.02),
          block(frame, 0.4, 0.44, -0.02, 0.02, 0.34, 1.0)};
}

Model railing_model(double length, double height, Random& random) {
  const double radius = random.uniform(0.015, 0.035);
  const Mat3 along = rotation_y(kPi / 2);
  Model model;
  for (const double z : {0.35 * height, 0.67 * height, height}) {
    model.push_back(rod(kMaterials.railing, vec(0, 0, z), radius, length, along));
  }
  const double gap = random.uniform(1.2, 2.2);
  for (double x = -length / 2; x <= length / 2; x += gap) {
    model.push_back(post(kMaterials.railing, x, 0, -0.3, height, 1.3 * radius));
  }
  return model;
}

Model paling_model(double length, double height, Random& random) {
  const double pale = random.uniform(0.04, 0.09), pitch = pale + random.uniform(0.04, 0.12);
  Model model;
  for (double x = -length / 2; x < length / 2; x += pitch) {
    model.push_back(block(kMaterials.wood_fence, x, x + pale, -0.012, 0.012, -0.1, height));
  }
  for (const double z : {0.25 * height, 0.8 * height}) {
    model.push_back(
        block(kMaterials.wood_fence, -length / 2, length / 2, 0.012, 0.05, z - 0.04, z + 0.04));
  }
  return model;
}

Model wire_model(double length, double height, Random& random) {
  const double radius = random.uniform(0.005, 0.02), sag = 0.02 * length;
  constexpr int kPieces = 4;
  const auto height_at = [&](double u) { return height - sag * 4 * u * (1 - u); };
  Model model;
  for (int i = 0; i < kPieces; ++i) {
    const double u0 = static_cast<double>(i) / kPieces, u1 = static_cast<double>(i + 1) / kPieces;
    const double rise = height_at(u1) - height_at(u0), run = length / kPieces;
    const Vec3 middle =
        vec((0.5 * (u0 + u1) - 0.5) * length, 0, 0.5 * (height_at(u0) + height_at(u1)));
    model.push_back(rod(kMaterials.wire, middle, radius, std::sqrt(rise * rise + run * run),
                        rotation_y(kPi / 2 - std::atan2(rise, run))));
  }
  return model;
}

Model sign_model(Random& random) {
  const double height = random.uniform(1.8, 3.2), radius = random.uniform(0.025, 0.05);
  const double half_width = random.uniform(0.2, 0.9), half_height = random.uniform(0.2, 0.5);
  Model model{post(kMaterials.steel_pole, 0, 0, -0.3, height, radius)};
  if (half_width > 0.6) model.push_back(post(kMaterials.steel_pole, 0, 0.5, -0.3, height, radius));
  model.push_back(block(kMaterials.sign_plate, -0.06, -0.04, -half_width, half_width,
                        height - 2 * half_height, height));
  return model;
}

Model trolley_model(Random& random) {
  const double length = random.uniform(0.8, 1.1);
  const double l = length / 2;
  return {block(kMaterials.mesh, -l, l, -0.28, 0.28, 0.45, 1.0),
          block(kMaterials.mesh, -l, l, -0.25, 0.25, 0.12, 0.22),
          block(kMaterials.street_furniture, -l - 0.08, -l, -0.28, 0.28, 0.98, 1.03)};
}

}  // namespace dynains::simulation
