#include "dynains/points.hpp"

std::size_t count(const dynains::PointBuffer& points) { return points.size(); }
