#include "trundle/geometry/thinning.hpp"

#include <utility>

namespace trundle::geometry {
namespace {

template <class Values>
void keep_every_second(Values& values) {
  for (std::size_t i = 1; 2 * i < values.size(); ++i) values[i] = values[2 * i];
  values.resize((values.size() + 1) / 2);
}

}  // namespace

void ThinnedTrajectory::add(const StampedPose& pose, const Matrix3& covariance) {
  last_ = pose;
  last_covariance_ = covariance;
  if (count_++ % stride_ != 0) return;
  if (kept_.poses.size() == most_) {
    keep_every_second(kept_.poses);
    keep_every_second(kept_.covariances);
    stride_ *= 2;
    if ((count_ - 1) % stride_ != 0) return;
  }
  keep();
}

void ThinnedTrajectory::keep() {
  kept_.poses.push_back(last_);
  if (with_covariance_) kept_.covariances.push_back(last_covariance_);
}

Trajectory ThinnedTrajectory::take() {
  if (!keeps_last()) keep();
  return std::move(kept_);
}

std::size_t ThinnedTrajectory::left_out() const {
  return count_ - kept_.poses.size() - (keeps_last() ? 0 : 1);
}

}  // namespace trundle::geometry
