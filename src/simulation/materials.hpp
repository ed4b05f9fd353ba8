// Surfaces of the simulated world with their SemanticKITTI classes.
#pragma once

#include "simulation/primitive.hpp"

namespace dynains::simulation {

/// Classes of SemanticKITTI, at rest; models.cpp has those in motion.
namespace semantic {
enum Class : std::uint16_t {
  kOutlier = 1,
  kCar = 10,
  kBicycle = 11,
  kBus = 13,
  kTruck = 18,
  kPerson = 30,
  kBicyclist = 31,
  kRoad = 40,
  kParking = 44,
  kSidewalk = 48,
  kBuilding = 50,
  kFence = 51,
  kOtherStructure = 52,
  kVegetation = 70,
  kTrunk = 71,
  kTerrain = 72,
  kPole = 80,
  kSign = 81,
  kOtherObject = 99,
};
}  // namespace semantic

/// All surfaces of the simulated world.
struct Materials {
  //                  label                 refl   loss  density clump rough window
  Material facade{semantic::kBuilding, 0.35F, 0.02F, 0, 0, 0.01F, 3.0F};
  Material wall{semantic::kBuilding, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material roof{semantic::kBuilding, 0.25F, 0.05F, 0, 0, 0.02F, 0};
  Material concrete{semantic::kOtherStructure, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material tree_trunk{semantic::kTrunk, 0.3F, 0.03F, 0, 0, 0.015F, 0};
  Material leaves{semantic::kVegetation, 0.35F, 0.10F, 1.6F, 0.45F, 0, 0};
  Material thin_leaves{semantic::kVegetation, 0.35F, 0.15F, 0.6F, 0.6F, 0, 0};
  Material bush{semantic::kVegetation, 0.35F, 0.08F, 5.0F, 0.2F, 0, 0};
  Material hedge{semantic::kVegetation, 0.35F, 0.06F, 9.0F, 0.15F, 0, 0};
  Material leaf_clump{semantic::kVegetation, 0.35F, 0.10F, 3.0F, 0.12F, 0, 0};
  Material bare_twigs{semantic::kVegetation, 0.25F, 0.15F, 0.5F, 0.15F, 0, 0};
  Material open_hedge{semantic::kVegetation, 0.35F, 0.08F, 3.5F, 0.15F, 0, 0};
  Material glass_pane{semantic::kBuilding, 0.1F, 0.3F, 12.0F, 0, 0, 0};
  Material wire_fence{semantic::kFence, 0.3F, 0.10F, 5.0F, 0, 0, 0};
  Material wood_fence{semantic::kFence, 0.4F, 0.03F, 0, 0, 0.01F, 0};
  Material guard_rail{semantic::kFence, 0.6F, 0.05F, 0, 0, 0, 0};
  Material steel_pole{semantic::kPole, 0.5F, 0.02F, 0, 0, 0, 0};
  Material sign_plate{semantic::kSign, 0.95F, 0.0F, 0, 0, 0, 0};
  Material street_furniture{semantic::kOtherObject, 0.4F, 0.02F, 0, 0, 0, 0};
  Material bright_paint{semantic::kCar, 0.6F, 0.06F, 0, 0, 0, 0};
  Material dark_paint{semantic::kCar, 0.12F, 0.14F, 0, 0, 0, 0};
  Material glass{semantic::kCar, 0.1F, 0.5F, 0, 0, 0.01F, 0};
  Material tyre{semantic::kCar, 0.08F, 0.15F, 0, 0, 0, 0};
  Material plate{semantic::kCar, 0.95F, 0, 0, 0, 0, 0};
  Material bright_cloth{semantic::kPerson, 0.5F, 0.01F, 0, 0, 0.01F, 0};
  Material dark_cloth{semantic::kPerson, 0.2F, 0.05F, 0, 0, 0.01F, 0};
  Material skin{semantic::kPerson, 0.4F, 0.02F, 0, 0, 0.005F, 0};
  Material metal{semantic::kBicycle, 0.3F, 0.2F, 3.0F, 0, 0, 0};
  Material bicycle_frame{semantic::kBicycle, 0.3F, 0.05F, 0, 0, 0, 0};
  Material railing{semantic::kFence, 0.5F, 0.03F, 0, 0, 0, 0};
  Material wire{semantic::kOtherObject, 0.3F, 0.1F, 0, 0, 0, 0};
  Material mesh{semantic::kOtherObject, 0.4F, 0.1F, 4.0F, 0, 0, 0};
  Material ego_roof{semantic::kOutlier, 0.3F, 0.1F, 0, 0, 0, 0};
};
inline constexpr Materials kMaterials;

}  // namespace dynains::simulation
