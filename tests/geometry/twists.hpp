#pragma once

#include <array>
#include <ostream>
#include <vector>

#include "trundle/geometry/pose2.hpp"

#include "property.hpp"

namespace trundle::geometry {

// How RapidCheck shows what falsified a property.
inline void showValue(const Twist2& twist, std::ostream& out) {
  out << twist.vector().transpose();
}
inline void showValue(const Pose2& pose, std::ostream& out) {
  out << pose.x << ' ' << pose.y << ' ' << pose.heading;
}

}  // namespace trundle::geometry

namespace trundle::test {
using namespace geometry;

/// Turns where formulas with 0/0 in them, or with a branch, go wrong.
inline std::vector<double> delicate_turns() {
  std::vector<double> turns{0.0};
  for (const double turn :
       {1e-300, 1e-12, 1e-9, 1e-6, 1e-3, 0.249999, 0.250001, 1.0, std::nextafter(kPi, 0.0), kPi}) {
    turns.push_back(turn);
    turns.push_back(-turn);
  }
  return turns;
}

inline std::vector<Twist2> delicate_twists() {
  std::vector<Twist2> twists;
  for (const double turn : delicate_turns())
    for (const auto& [dx, dy] :
         std::array<std::pair<double, double>, 4>{{{0, 0}, {1.5, 0}, {0, -2}, {0.7, 0.3}}})
      twists.push_back({dx, dy, turn});
  return twists;
}

inline rc::Gen<Twist2> any_twist() {
  return rc::gen::map(rc::gen::tuple(uniform(-5, 5), uniform(-5, 5), uniform(-kPi, kPi)), [](const auto& v) {
    return Twist2{std::get<0>(v), std::get<1>(v), std::get<2>(v)};
  });
}

/// With headings of several turns.
inline rc::Gen<Pose2> any_pose() {
  return rc::gen::map(rc::gen::tuple(uniform(-5, 5), uniform(-5, 5), uniform(-20, 20)), [](const auto& v) {
    return Pose2{std::get<0>(v), std::get<1>(v), std::get<2>(v)};
  });
}

inline Vector3 vector_of(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

}  // namespace trundle::test
