#include "trundle/slam/ekf/ekf_belief.hpp"

#include <algorithm>

namespace trundle::slam {
namespace {

/// An unidentified landmark that has this id gets another.
void give_id(std::size_t landmark, LandmarkId id, EkfBelief& belief) {
  const auto other = std::ranges::find(belief.landmarks, id, &EkfBelief::Landmark::id);
  if (other != belief.landmarks.end()) other->id = belief.next_unidentified++;
  belief.next_unidentified = std::max(belief.next_unidentified, id + 1);
  belief.landmarks[landmark].id = id;
  const auto i = static_cast<std::size_t>(id);
  if (belief.index_of.size() <= i) belief.index_of.resize(i + 1, EkfBelief::kNone);
  belief.index_of[i] = static_cast<std::int64_t>(landmark);
}

}  // namespace

std::int64_t EkfBelief::find(LandmarkId id) const {
  const auto i = static_cast<std::size_t>(id);
  return i < index_of.size() ? index_of[i] : kNone;
}

void predict(const Motion& motion, EkfBelief& belief) {
  JointGaussian& joint = belief.joint;
  const Pose2 before = joint.pose();
  const BySystematic by_systematic = motion.by_first(joint.systematic());
  const Pose2 after = before * motion.mean * exp(Twist2::from(by_systematic * joint.body().systematic));
  const Matrix3 R = world_from_body_axes(after);
  JointGaussian::Prediction prediction{after, Matrix3::Identity(), R * by_systematic,
                                       R * motion.covariance * R.transpose()};
  prediction.F(0, 2) = -(after.y - before.y);
  prediction.F(1, 2) = after.x - before.x;
  if (joint.systematic() > 0) {
    prediction.walk = motion.walk;
    prediction.with_walk = R * motion.with_walk;
  }
  joint.predict(prediction);
}

void read_bias(const BiasReading& reading, EkfBelief& belief) {
  if (belief.joint.systematic() > 0) belief.joint.read_systematic(reading.rad_s, reading.variance);
}

std::size_t augment(const Observation& observation, const LandmarkSensor& sensor, EkfBelief& belief) {
  const Pose2 pose = belief.joint.pose();
  const SightedLandmark sighted = sighted_landmark(pose, sensor.body_from_sensor, observation);
  belief.joint.append(sighted.in_world, sighted.by_pose, sighted.spread(reading_covariance(sensor)));
  const std::size_t landmark = belief.landmarks.size();
  const bool is_identified = observation.landmark >= 0;
  belief.landmarks.push_back({kUnknownLandmark, 1, is_identified, {0.0, pose.translation()}});
  if (is_identified) {
    give_id(landmark, observation.landmark, belief);
  } else {
    belief.landmarks[landmark].id = belief.next_unidentified++;
    belief.grid.put(landmark, sighted.in_world);
  }
  return landmark;
}

void remove_landmark(std::size_t landmark, EkfBelief& belief) {
  auto& landmarks = belief.landmarks;
  belief.joint.remove(landmark);
  landmarks[landmark] = landmarks.back();
  landmarks.pop_back();
  if (landmark < landmarks.size() && landmarks[landmark].is_identified)
    belief.index_of[static_cast<std::size_t>(landmarks[landmark].id)] = static_cast<std::int64_t>(landmark);
  refresh_grid(belief);
}

void note_moved(std::size_t landmark, EkfBelief& belief) {
  if (!belief.grid.contains(landmark)) return;
  const double moved_m = (belief.joint.landmark(landmark) - belief.grid.place(landmark)).norm();
  belief.off_grid_m = std::max(belief.off_grid_m, moved_m);
}

void refresh_grid(EkfBelief& belief) {
  belief.grid.clear();
  for (std::size_t i = 0; i < belief.landmarks.size(); ++i)
    if (!belief.landmarks[i].is_identified) belief.grid.put(i, belief.joint.landmark(i));
  belief.off_grid_m = 0.0;
}

}  // namespace trundle::slam
