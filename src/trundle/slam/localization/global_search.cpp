#include "trundle/slam/localization/global_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/rigid_motion.hpp"

namespace trundle {
namespace {

constexpr std::size_t kMostPairs = 6;        // of points, tried in one step
constexpr std::size_t kMostHypotheses = 64;  // kept
constexpr double kReach = 16.0;              // hypotheses whose log odds are so far below the best are none
constexpr double kSamePlace_m = 0.5;
constexpr double kSameHeading_rad = radians(10.0);

struct SightedPair {
  const SightedPoint* first;
  const SightedPoint* second;
  double baseline_m;
  double sigma_m;  ///< of the baseline
};

/// A point as a pose expects it: −residual's derivative and its own covariance.
struct PointSight {
  Vector2 residual;
  Matrix23 H;  ///< of the expected point by (x, y, heading)
  Matrix2 noise;
};

/// Eq. 47: q = Rᵀ(m − p).
PointSight point_sight(const Pose2& pose, const SightedPoint& point, const KnownLandmark& landmark) {
  const Matrix2 Rt = rotation(-pose.heading);
  const Vector2 expected = Rt * (landmark.position - pose.translation());
  PointSight sight;
  sight.residual = point.in_body - expected;
  sight.H << -Rt, Vector2(expected.y(), -expected.x());
  sight.noise = point.covariance + Rt * landmark.covariance * Rt.transpose();
  return sight;
}

double log_normal(double squared_distance, const Matrix2& covariance) {
  return -0.5 * (squared_distance + std::log(covariance.determinant())) - std::log(2.0 * kPi);
}

/// Judges one constellation.
class GlobalSearch {
 public:
  GlobalSearch(const LocalMap& seen, const KnownMap& map, const LandmarkSensor& sensor,
               const MapSightOptions& options)
      : seen_(seen),
        map_(map),
        sensor_(sensor),
        options_(options),
        log_space_(std::log(2.0 * kPi * map.area_m2(sensor.max_range_m))) {
    for (const SightedPoint& point : seen.points()) crowds_.push_back(crowd_of(point));
  }

  std::vector<PoseHypothesis> run() {
    for (const SightedPair& pair : best_pairs()) try_pair(pair);
    std::ranges::stable_sort(found_, std::greater{}, &PoseHypothesis::log_odds);
    return distinct();
  }

  double log_odds_at(const PoseEstimate& pose) const {
    PoseHypothesis hypothesis{pose};
    hypothesis.pose.covariance =
        Vector3(kSamePlace_m * kSamePlace_m, kSamePlace_m * kSamePlace_m, kSameHeading_rad * kSameHeading_rad)
            .asDiagonal();
    hypothesis.log_odds =
        0.5 * std::log(hypothesis.pose.covariance.determinant()) + 1.5 * std::log(2.0 * kPi) - log_space_;
    std::vector<LandmarkId> taken;
    add_points(hypothesis, {}, taken);
    return hypothesis.log_odds;
  }

 private:
  /// Of points of which one at least was seen just now: the longest baselines in their sigmas.
  std::vector<SightedPair> best_pairs() const {
    std::vector<SightedPair> pairs;
    const auto points = seen_.points();
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j) {
        if (points[j].step != seen_.now()) continue;
        if (!is_usable(points[i]) || !is_usable(points[j])) continue;
        const Vector2 apart = points[j].in_body - points[i].in_body;
        const double baseline = apart.norm();
        const Matrix2 both = points[i].covariance + points[j].covariance;
        const double sigma = std::sqrt(apart.dot(both * apart)) / std::max(baseline, 1e-9);
        const bool same_name = points[i].landmark >= 0 && points[i].landmark == points[j].landmark;
        if (!same_name && baseline > 5.0 * sigma) pairs.push_back({&points[i], &points[j], baseline, sigma});
      }
    std::ranges::stable_sort(pairs, std::greater{},
                             [](const SightedPair& p) { return p.baseline_m / p.sigma_m; });
    if (pairs.size() > kMostPairs) pairs.resize(kMostPairs);
    return pairs;
  }

  /// A name that the map has, or none.
  bool is_usable(const SightedPoint& point) const {
    return point.landmark == kUnknownLandmark || map_.has(point.landmark);
  }
  bool may_be(const SightedPoint& point, LandmarkId landmark) const {
    return point.landmark == kUnknownLandmark || point.landmark == landmark;
  }

  void try_pair(const SightedPair& pair) {
    const double reach = std::sqrt(options_.gate) * pair.sigma_m + 2.0 * std::sqrt(map_.largest_variance());
    if (map_.has(pair.first->landmark) && map_.has(pair.second->landmark))
      return try_landmarks(pair, pair.first->landmark, pair.second->landmark);
    for (const KnownMap::Pair& p : map_.pairs(pair.baseline_m - reach, pair.baseline_m + reach)) {
      if (may_be(*pair.first, p.first) && may_be(*pair.second, p.second))
        try_landmarks(pair, p.first, p.second);
      if (may_be(*pair.first, p.second) && may_be(*pair.second, p.first))
        try_landmarks(pair, p.second, p.first);
    }
  }

  void try_landmarks(const SightedPair& pair, LandmarkId first, LandmarkId second) {
    auto hypothesis = from_pair(pair, first, second);
    if (!hypothesis) return;
    std::vector<LandmarkId> taken = {first, second};
    add_points(*hypothesis, pair, taken);
    best_ = std::max(best_, hypothesis->log_odds);
    if (hypothesis->log_odds > best_ - kReach) found_.push_back(*hypothesis);
  }

  /// log of the density of a point that is no landmark of the map, or has a wrong name: anywhere in sight.
  double log_chance(const SightedPoint& point) const {
    const double names = point.landmark == kUnknownLandmark ? 1.0 : static_cast<double>(map_.size());
    return -std::log(kPi * sensor_.max_range_m * sensor_.max_range_m * names);
  }
  /// Of one that is: any of those in view, where it has no name.
  double log_landmark(const SightedPoint& point, const PoseEstimate& pose) const {
    const bool named = point.landmark != kUnknownLandmark;
    const double in_view = named ? 1.0 : static_cast<double>(landmarks_in_view(pose, map_, sensor_));
    return std::log1p(-options_.outlier_share) - std::log(std::max(1.0, in_view));
  }

  /// Eq. 47, 48: least squares for the pose from two points, and what they weigh together.
  std::optional<PoseHypothesis> from_pair(const SightedPair& pair, LandmarkId first,
                                          LandmarkId second) const {
    const PointPair ends[] = {{pair.first->in_body, map_[first].position},
                              {pair.second->in_body, map_[second].position}};
    const std::optional<Pose2> start = rigid_motion(ends);
    if (!start) return std::nullopt;
    PoseHypothesis hypothesis;
    PoseEstimate& pose = hypothesis.pose;
    pose.pose = *start;
    double squares = 0.0;
    double log_noise = 0.0;
    for (int round = 0; round < 2; ++round) {
      Matrix3 information = Matrix3::Zero();
      Vector3 gradient = Vector3::Zero();
      squares = log_noise = 0.0;
      for (const auto& [point, landmark] : {std::pair(pair.first, first), std::pair(pair.second, second)}) {
        const PointSight sight = point_sight(pose.pose, *point, map_[landmark]);
        const Matrix2 weight = sight.noise.inverse();
        information += sight.H.transpose() * weight * sight.H;
        gradient += sight.H.transpose() * weight * sight.residual;
        squares += sight.residual.dot(weight * sight.residual);
        log_noise += std::log(sight.noise.determinant());
      }
      pose.covariance = information.inverse();
      const Vector3 change = pose.covariance * gradient;
      squares -= change.dot(gradient);
      pose.pose = {pose.pose.x + change.x(), pose.pose.y + change.y(), pose.pose.heading + change.z()};
    }
    if (squares > options_.gate) return std::nullopt;
    hypothesis.log_odds = -0.5 * (squares + log_noise) - 2.0 * std::log(2.0 * kPi) +
                          0.5 * std::log(pose.covariance.determinant()) + 1.5 * std::log(2.0 * kPi) -
                          log_space_;
    for (const SightedPoint* point : {pair.first, pair.second})
      hypothesis.log_odds += log_landmark(*point, pose) - log_chance(*point);
    hypothesis.matched = 2;
    return hypothesis;
  }

  /// Eq. 49: the points that are not of the pair, the newest first, each as a measurement of the pose or as
  /// no landmark. No landmark is two points.
  void add_points(PoseHypothesis& hypothesis, const SightedPair& pair, std::vector<LandmarkId>& taken) const {
    const auto points = seen_.points();
    for (std::size_t i = points.size(); i-- > 0;) {
      const SightedPoint& point = points[i];
      if (&point == pair.first || &point == pair.second || !is_usable(point)) continue;
      const double log_in_map = take(hypothesis, point, taken) + log_landmark(point, hypothesis.pose);
      const double gain = std::log(std::exp(log_in_map - log_chance(point)) + options_.outlier_share);
      hypothesis.log_odds += gain / crowds_[i];
    }
  }

  /// Points in one place are one witness.
  double crowd_of(const SightedPoint& point) const {
    return static_cast<double>(std::ranges::count_if(
        seen_.points(), [&](const SightedPoint& p) { return are_one_place(p, point); }));
  }

  /// Improves the hypothesis by a point, if a landmark fits that no other point has taken; returns the
  /// point's log density then, else −∞.
  double take(PoseHypothesis& hypothesis, const SightedPoint& point, std::vector<LandmarkId>& taken) const {
    PoseEstimate& pose = hypothesis.pose;
    double best = options_.gate;
    std::optional<PointSight> chosen;
    LandmarkId landmark = kUnknownLandmark;
    Matrix2 S_chosen;
    for (const LandmarkId id : candidates(pose, point)) {
      if (std::ranges::find(taken, id) != taken.end()) continue;
      const PointSight sight = point_sight(pose.pose, point, map_[id]);
      const Matrix2 S = sight.H * pose.covariance * sight.H.transpose() + sight.noise;
      const double squared = sight.residual.dot(S.llt().solve(sight.residual));
      if (squared > best) continue;
      best = squared;
      chosen = sight;
      landmark = id;
      S_chosen = S;
    }
    if (!chosen) return -std::numeric_limits<double>::infinity();
    const Eigen::Matrix<double, 3, 2> K = pose.covariance * chosen->H.transpose() * S_chosen.inverse();
    const Vector3 change = K * chosen->residual;
    pose.pose = {pose.pose.x + change.x(), pose.pose.y + change.y(), pose.pose.heading + change.z()};
    pose.covariance -= K * S_chosen * K.transpose();
    ++hypothesis.matched;
    taken.push_back(landmark);
    return log_normal(best, S_chosen);
  }

  std::vector<LandmarkId> candidates(const PoseEstimate& pose, const SightedPoint& point) const {
    if (point.landmark != kUnknownLandmark) return {point.landmark};
    const double lever2 = point.in_body.squaredNorm();
    const double variance = pose.covariance(0, 0) + pose.covariance(1, 1) + lever2 * pose.covariance(2, 2) +
                            point.covariance.trace() + map_.largest_variance();
    return map_.within(pose.pose * point.in_body, std::sqrt(2.0 * options_.gate * variance));
  }

  std::vector<PoseHypothesis> distinct() const {
    std::vector<PoseHypothesis> kept;
    for (const PoseHypothesis& candidate : found_) {
      const auto is_same = [&](const PoseHypothesis& other) {
        return is_same_place(other.pose.pose, candidate.pose.pose);
      };
      if (kept.size() == kMostHypotheses) break;
      if (std::ranges::none_of(kept, is_same)) kept.push_back(candidate);
    }
    return kept;
  }

  const LocalMap& seen_;
  const KnownMap& map_;
  const LandmarkSensor& sensor_;
  const MapSightOptions& options_;
  double log_space_;            ///< of the poses that there are
  std::vector<double> crowds_;  ///< of each point: how many are in its place
  std::vector<PoseHypothesis> found_;
  double best_ = 0.0;  ///< log odds of the best one found, or of none
};

}  // namespace

std::vector<PoseHypothesis> find_poses(const LocalMap& seen, const KnownMap& map,
                                       const LandmarkSensor& sensor, const MapSightOptions& options) {
  return GlobalSearch(seen, map, sensor, options).run();
}

double log_odds_at(const PoseEstimate& pose, const LocalMap& seen, const KnownMap& map,
                   const LandmarkSensor& sensor, const MapSightOptions& options) {
  return GlobalSearch(seen, map, sensor, options).log_odds_at(pose);
}

bool is_same_place(const Pose2& a, const Pose2& b) {
  const Pose2 apart = a.inverse() * b;
  return apart.translation().norm() < kSamePlace_m && std::abs(wrap_angle(apart.heading)) < kSameHeading_rad;
}

}  // namespace trundle
