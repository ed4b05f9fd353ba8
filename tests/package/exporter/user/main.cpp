#include "dynains/points.hpp"

std::size_t count(const dynains::PointBuffer& points);

int main() {
  dynains::PointBuffer points;
  points.push_back(1.0F, 2.0F, 3.0F);
  return count(points) == 1 ? 0 : 1;
}
