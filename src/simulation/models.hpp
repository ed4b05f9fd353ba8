// Compound objects. Frame of every model: z = 0 on the ground, x forward, origin in the middle.
#pragma once

#include <vector>

#include "simulation/primitive.hpp"
#include "simulation/random.hpp"

namespace dynains::simulation {

/// Primitives in the axes of the model. Each function adds one; lengths in m.
struct Model : std::vector<Primitive> {
  /// Corner-to-corner box, whose sides at the top have moved inwards by `taper_x`, `taper_y`.
  Model& block(const Material& material, double x0, double x1, double y0, double y1, double z0,
               double z1, double taper_x = 0, double taper_y = 0);
  Model& post(const Material& material, double x, double y, double z0, double z1, double radius);
  /// A cylinder along `rotation` times z.
  Model& rod(const Material& material, Vec3 centre, double radius, double length,
             const Mat3& rotation);
  Model& ball(const Material& material, double x, double y, double z, double rx, double ry,
              double rz, const Mat3& rotation = {});
  /// Wheels that stand on the ground, across the x axis, at `front` and `rear`, and at both
  /// `side`s.
  Model& wheels(const Material& material, double front, double rear, double side, double radius,
                double half_width);
  /// A limb that hangs from (x, y, z), turned by `swing` (rad) about the y axis.
  Model& limb(const Material& material, double x, double y, double z, double length, double radius,
              double swing);
};

enum class Kind { kCar, kVan, kTruck, kBus, kPedestrian, kCyclist };

struct Size {
  double length = 0, width = 0, height = 0;
};

/// Classes of SemanticKITTI of a kind at rest and in motion; its smallest size (m), and how much
/// larger it may be.
struct KindTraits {
  std::uint16_t resting, moving;
  Size least, more;
};
const KindTraits& traits_of(Kind kind);
Size random_size(Kind kind, Random& random);

/// Vehicles do not change their shape.
Model vehicle_model(Kind kind, const Size& size, Random& random);
/// People do: `phase` is the angle of the gait or of the pedals, `stride` its amplitude, 0 to 1.
Model pedestrian_model(const Size& size, std::uint64_t seed, double phase, double stride);
Model cyclist_model(const Size& size, std::uint64_t seed, double phase);

/// Plants. `open`: with gaps between separate clumps of leaves; a third of the trees are bare.
Model tree_model(bool open, double height, double crown, double clear, Random& random);
Model bush_model(bool open, double radius, double height, Random& random);
Model hedge_model(bool open, double length, double width, double height, Random& random);

/// A pole, some thinner than the step between beams, with a lamp over the street, or with signs.
Model pole_model(double height, bool lamp, bool sign, Random& random);
/// Front along x, `depth` to the left (y from 0 to depth), base below the ground.
Model building_model(double length, double depth, double height, Random& random);
enum class Fence { kWood, kWire, kRailing, kPales, kGuardRail };
Model fence_model(Fence fence, double length, double height, Random& random);
/// Deck across the x axis with pillars `span / 2` to both sides.
Model bridge_model(double span, double width, double clearance);
/// A wire along x between two poles at its ends; they are not part of it.
Model wire_model(double length, double height, Random& random);
Model bicycle_model();
/// A bin, a bench, a box, a trolley, or a stall.
Model furniture_model(Random& random);

/// A ceiling, a floor or a column between two heights (m).
Model slab_model(double length, double width, double bottom, double top);
/// Walls along x; their inner faces are in the plane y = 0.
Model wall_model(double length, double height);
Model glass_front_model(double length, double height);

}  // namespace dynains::simulation
