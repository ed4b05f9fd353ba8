// Surfaces of the simulated world with their SemanticKITTI classes.
#pragma once

#include "simulation/primitive.hpp"

namespace dynains::simulation {

namespace semantic {
inline constexpr std::uint16_t kUnlabeled = 0, kOutlier = 1, kCar = 10, kBicycle = 11, kBus = 13,
                               kTruck = 18, kPerson = 30, kBicyclist = 31, kRoad = 40,
                               kParking = 44, kSidewalk = 48, kBuilding = 50, kFence = 51,
                               kOtherStructure = 52, kLaneMarking = 60, kVegetation = 70,
                               kTrunk = 71, kTerrain = 72, kPole = 80, kSign = 81,
                               kOtherObject = 99, kMovingCar = 252, kMovingBicyclist = 253,
                               kMovingPerson = 254, kMovingBus = 257, kMovingTruck = 258;
}  // namespace semantic

namespace materials {
using namespace semantic;
//                                     label         refl   loss  density clump rough window
inline constexpr Material kFacade{kBuilding, 0.35F, 0.02F, 0, 0, 0.01F, 3.0F};
inline constexpr Material kWall{kBuilding, 0.4F, 0.02F, 0, 0, 0.01F, 0};
inline constexpr Material kRoof{kBuilding, 0.25F, 0.05F, 0, 0, 0.02F, 0};
inline constexpr Material kConcrete{kOtherStructure, 0.4F, 0.02F, 0, 0, 0.01F, 0};
inline constexpr Material kTreeTrunk{kTrunk, 0.3F, 0.03F, 0, 0, 0.015F, 0};
inline constexpr Material kLeaves{kVegetation, 0.35F, 0.10F, 1.6F, 0.45F, 0, 0};
inline constexpr Material kThinLeaves{kVegetation, 0.35F, 0.15F, 0.6F, 0.6F, 0, 0};
inline constexpr Material kBush{kVegetation, 0.35F, 0.08F, 5.0F, 0.2F, 0, 0};
inline constexpr Material kHedge{kVegetation, 0.35F, 0.06F, 9.0F, 0.15F, 0, 0};
inline constexpr Material kGrass{kVegetation, 0.3F, 0.15F, 2.5F, 0.12F, 0, 0};
inline constexpr Material kWireFence{kFence, 0.3F, 0.10F, 5.0F, 0, 0, 0};
inline constexpr Material kWoodFence{kFence, 0.4F, 0.03F, 0, 0, 0.01F, 0};
inline constexpr Material kGuardRail{kFence, 0.6F, 0.05F, 0, 0, 0, 0};
inline constexpr Material kSteelPole{kPole, 0.5F, 0.02F, 0, 0, 0, 0};
inline constexpr Material kSignPlate{kSign, 0.95F, 0.0F, 0, 0, 0, 0};
inline constexpr Material kStreetFurniture{kOtherObject, 0.4F, 0.02F, 0, 0, 0, 0};
inline constexpr Material kBrightPaint{kCar, 0.6F, 0.06F, 0, 0, 0, 0};
inline constexpr Material kDarkPaint{kCar, 0.12F, 0.14F, 0, 0, 0, 0};
inline constexpr Material kGlass{kCar, 0.1F, 0.5F, 0, 0, 0.01F, 0};
inline constexpr Material kTyre{kCar, 0.08F, 0.15F, 0, 0, 0, 0};
inline constexpr Material kPlate{kCar, 0.95F, 0, 0, 0, 0, 0};
inline constexpr Material kBrightCloth{kPerson, 0.5F, 0.01F, 0, 0, 0.01F, 0};
inline constexpr Material kDarkCloth{kPerson, 0.2F, 0.05F, 0, 0, 0.01F, 0};
inline constexpr Material kSkin{kPerson, 0.4F, 0.02F, 0, 0, 0.005F, 0};
inline constexpr Material kMetal{kBicycle, 0.3F, 0.2F, 3.0F, 0, 0, 0};
inline constexpr Material kEgoRoof{kOutlier, 0.3F, 0.1F, 0, 0, 0, 0};
}  // namespace materials

}  // namespace dynains::simulation
