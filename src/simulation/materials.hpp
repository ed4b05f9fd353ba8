// Surfaces of the simulated world with their SemanticKITTI classes.
#pragma once

#include "simulation/primitive.hpp"

namespace dynains::simulation {

/// Classes of SemanticKITTI, at rest; models.cpp has those in motion.
struct Classes {
  std::uint16_t outlier = 1;
  std::uint16_t car = 10, bicycle = 11, bus = 13, truck = 18, person = 30, bicyclist = 31;
  std::uint16_t road = 40, parking = 44, sidewalk = 48, terrain = 72;
  std::uint16_t building = 50, fence = 51, other_structure = 52, pole = 80, sign = 81;
  std::uint16_t vegetation = 70, trunk = 71, other_object = 99;
};
inline constexpr Classes kClasses;

/// All surfaces of the simulated world.
struct Materials {
  //                  label                 refl   loss  density clump rough window
  Material facade{kClasses.building, 0.35F, 0.02F, 0, 0, 0.01F, 3.0F};
  Material wall{kClasses.building, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material roof{kClasses.building, 0.25F, 0.05F, 0, 0, 0.02F, 0};
  Material concrete{kClasses.other_structure, 0.4F, 0.02F, 0, 0, 0.01F, 0};
  Material tree_trunk{kClasses.trunk, 0.3F, 0.03F, 0, 0, 0.015F, 0};
  Material leaves{kClasses.vegetation, 0.35F, 0.10F, 1.6F, 0.45F, 0, 0};
  Material thin_leaves{kClasses.vegetation, 0.35F, 0.15F, 0.6F, 0.6F, 0, 0};
  Material bush{kClasses.vegetation, 0.35F, 0.08F, 5.0F, 0.2F, 0, 0};
  Material hedge{kClasses.vegetation, 0.35F, 0.06F, 9.0F, 0.15F, 0, 0};
  Material leaf_clump{kClasses.vegetation, 0.35F, 0.10F, 3.0F, 0.12F, 0, 0};
  Material bare_twigs{kClasses.vegetation, 0.25F, 0.15F, 0.5F, 0.15F, 0, 0};
  Material open_hedge{kClasses.vegetation, 0.35F, 0.08F, 3.5F, 0.15F, 0, 0};
  Material glass_pane{kClasses.building, 0.1F, 0.3F, 12.0F, 0, 0, 0};
  Material wire_fence{kClasses.fence, 0.3F, 0.10F, 5.0F, 0, 0, 0};
  Material wood_fence{kClasses.fence, 0.4F, 0.03F, 0, 0, 0.01F, 0};
  Material guard_rail{kClasses.fence, 0.6F, 0.05F, 0, 0, 0, 0};
  Material steel_pole{kClasses.pole, 0.5F, 0.02F, 0, 0, 0, 0};
  Material sign_plate{kClasses.sign, 0.95F, 0.0F, 0, 0, 0, 0};
  Material street_furniture{kClasses.other_object, 0.4F, 0.02F, 0, 0, 0, 0};
  Material bright_paint{kClasses.car, 0.6F, 0.06F, 0, 0, 0, 0};
  Material dark_paint{kClasses.car, 0.12F, 0.14F, 0, 0, 0, 0};
  Material glass{kClasses.car, 0.1F, 0.5F, 0, 0, 0.01F, 0};
  Material tyre{kClasses.car, 0.08F, 0.15F, 0, 0, 0, 0};
  Material plate{kClasses.car, 0.95F, 0, 0, 0, 0, 0};
  Material bright_cloth{kClasses.person, 0.5F, 0.01F, 0, 0, 0.01F, 0};
  Material dark_cloth{kClasses.person, 0.2F, 0.05F, 0, 0, 0.01F, 0};
  Material skin{kClasses.person, 0.4F, 0.02F, 0, 0, 0.005F, 0};
  Material metal{kClasses.bicycle, 0.3F, 0.2F, 3.0F, 0, 0, 0};
  Material bicycle_frame{kClasses.bicycle, 0.3F, 0.05F, 0, 0, 0, 0};
  Material railing{kClasses.fence, 0.5F, 0.03F, 0, 0, 0, 0};
  Material wire{kClasses.other_object, 0.3F, 0.1F, 0, 0, 0, 0};
  Material mesh{kClasses.other_object, 0.4F, 0.1F, 4.0F, 0, 0, 0};
  Material ego_roof{kClasses.outlier, 0.3F, 0.1F, 0, 0, 0, 0};
};
inline constexpr Materials kMaterials;

}  // namespace dynains::simulation
