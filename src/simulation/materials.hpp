// Surfaces of the simulated world with their SemanticKITTI classes.
#pragma once

#include "simulation/primitive.hpp"

namespace dynains::simulation {

namespace semantic {
inline constexpr std::uint16_t kOutlier = 1, kCar = 10, kBicycle = 11, kBus = 13, kTruck = 18,
                               kPerson = 30, kBicyclist = 31, kParking = 44, kSidewalk = 48,
                               kBuilding = 50, kFence = 51, kOtherStructure = 52, kVegetation = 70,
                               kTrunk = 71, kTerrain = 72, kPole = 80, kSign = 81,
                               kOtherObject = 99, kMovingCar = 252, kMovingBicyclist = 253,
                               kMovingPerson = 254, kMovingBus = 257, kMovingTruck = 258;
}  // namespace semantic

namespace materials {
//                                     label                 refl   loss  density clump rough window
inline constexpr Material kFacade{semantic::kBuilding, 0.35F, 0.02F, 0, 0, 0.01F, 3.0F};
inline constexpr Material kWall{semantic::kBuilding, 0.4F, 0.02F, 0, 0, 0.01F, 0};
inline constexpr Material kRoof{semantic::kBuilding, 0.25F, 0.05F, 0, 0, 0.02F, 0};
inline constexpr Material kConcrete{semantic::kOtherStructure, 0.4F, 0.02F, 0, 0, 0.01F, 0};
inline constexpr Material kTreeTrunk{semantic::kTrunk, 0.3F, 0.03F, 0, 0, 0.015F, 0};
inline constexpr Material kLeaves{semantic::kVegetation, 0.35F, 0.10F, 1.6F, 0.45F, 0, 0};
inline constexpr Material kThinLeaves{semantic::kVegetation, 0.35F, 0.15F, 0.6F, 0.6F, 0, 0};
inline constexpr Material kBush{semantic::kVegetation, 0.35F, 0.08F, 5.0F, 0.2F, 0, 0};
inline constexpr Material kHedge{semantic::kVegetation, 0.35F, 0.06F, 9.0F, 0.15F, 0, 0};
inline constexpr Material kLeafClump{semantic::kVegetation, 0.35F, 0.10F, 3.0F, 0.12F, 0, 0};
inline constexpr Material kBareTwigs{semantic::kVegetation, 0.25F, 0.15F, 0.5F, 0.15F, 0, 0};
inline constexpr Material kOpenHedge{semantic::kVegetation, 0.35F, 0.08F, 3.5F, 0.15F, 0, 0};
inline constexpr Material kGlassPane{semantic::kBuilding, 0.1F, 0.3F, 12.0F, 0, 0, 0};
inline constexpr Material kWireFence{semantic::kFence, 0.3F, 0.10F, 5.0F, 0, 0, 0};
inline constexpr Material kWoodFence{semantic::kFence, 0.4F, 0.03F, 0, 0, 0.01F, 0};
inline constexpr Material kGuardRail{semantic::kFence, 0.6F, 0.05F, 0, 0, 0, 0};
inline constexpr Material kSteelPole{semantic::kPole, 0.5F, 0.02F, 0, 0, 0, 0};
inline constexpr Material kSignPlate{semantic::kSign, 0.95F, 0.0F, 0, 0, 0, 0};
inline constexpr Material kStreetFurniture{semantic::kOtherObject, 0.4F, 0.02F, 0, 0, 0, 0};
inline constexpr Material kBrightPaint{semantic::kCar, 0.6F, 0.06F, 0, 0, 0, 0};
inline constexpr Material kDarkPaint{semantic::kCar, 0.12F, 0.14F, 0, 0, 0, 0};
inline constexpr Material kGlass{semantic::kCar, 0.1F, 0.5F, 0, 0, 0.01F, 0};
inline constexpr Material kTyre{semantic::kCar, 0.08F, 0.15F, 0, 0, 0, 0};
inline constexpr Material kPlate{semantic::kCar, 0.95F, 0, 0, 0, 0, 0};
inline constexpr Material kBrightCloth{semantic::kPerson, 0.5F, 0.01F, 0, 0, 0.01F, 0};
inline constexpr Material kDarkCloth{semantic::kPerson, 0.2F, 0.05F, 0, 0, 0.01F, 0};
inline constexpr Material kSkin{semantic::kPerson, 0.4F, 0.02F, 0, 0, 0.005F, 0};
inline constexpr Material kMetal{semantic::kBicycle, 0.3F, 0.2F, 3.0F, 0, 0, 0};
inline constexpr Material kBicycleFrame{semantic::kBicycle, 0.3F, 0.05F, 0, 0, 0, 0};
inline constexpr Material kRailing{semantic::kFence, 0.5F, 0.03F, 0, 0, 0, 0};
inline constexpr Material kWire{semantic::kOtherObject, 0.3F, 0.1F, 0, 0, 0, 0};
inline constexpr Material kMesh{semantic::kOtherObject, 0.4F, 0.1F, 4.0F, 0, 0, 0};
inline constexpr Material kPram{semantic::kPerson, 0.25F, 0.05F, 0, 0, 0.01F, 0};
inline constexpr Material kEgoRoof{semantic::kOutlier, 0.3F, 0.1F, 0, 0, 0, 0};
}  // namespace materials

}  // namespace dynains::simulation
