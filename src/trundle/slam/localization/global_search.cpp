#include "trundle/slam/localization/global_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/slam/association/relocalization.hpp"

namespace trundle::slam {
namespace {

// A baseline of fewer sigmas says too little of where two points lie to each other: the heading that follows
// from it is unsure by more than 1/5 rad, beyond which the linearised fit is none.
constexpr double kLeastBaseline = 5.0;  // [σ]
// What keeps a quotient finite where two points are one; shorter than any baseline that is used [m].
constexpr double kNoBaseline_m = 1e-9;

struct SightedPair {
  const SightedPoint* first;
  const SightedPoint* second;
  double baseline_m;
  double sigma_m;  ///< of the baseline
};

PointMatch match_of(const SightedPoint& point, const KnownLandmark& landmark) {
  return {point.in_body, point.covariance, landmark.position, landmark.covariance};
}

double log_normal(double squared_distance, const Matrix2& covariance) {
  return -0.5 * (squared_distance + std::log(covariance.determinant())) - std::log(2.0 * kPi);
}

/// The hypotheses that one local map suggests.
class GlobalSearch {
 public:
  GlobalSearch(const LocalMap& seen, const KnownMap& map, const LandmarkSensor& sensor,
               const MapSightOptions& options)
      : seen_(seen),
        map_(map),
        sensor_(sensor),
        options_(options),
        log_space_(std::log(2.0 * kPi * map.area_m2(sensor.max_range_m))) {
    for (const SightedPoint& point : seen.points()) repeats_.push_back(repeats_of(point));
  }

  std::vector<PoseHypothesis> run() {
    for (const SightedPair& pair : best_pairs()) try_pair(pair);
    std::ranges::stable_sort(found_, std::greater{}, &PoseHypothesis::log_odds);
    return distinct();
  }

  double log_odds_at(const PoseEstimate& pose) const {
    PoseHypothesis hypothesis{pose};
    const auto& [place_m, heading_rad] = options_.same;
    hypothesis.pose.covariance =
        Vector3(place_m * place_m, place_m * place_m, heading_rad * heading_rad).asDiagonal();
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
        const double sigma = std::sqrt(apart.dot(both * apart)) / std::max(baseline, kNoBaseline_m);
        const bool same_name = points[i].landmark >= 0 && points[i].landmark == points[j].landmark;
        if (!same_name && baseline > kLeastBaseline * sigma)
          pairs.push_back({&points[i], &points[j], baseline, sigma});
      }
    std::ranges::stable_sort(pairs, std::greater{},
                             [](const SightedPair& p) { return p.baseline_m / p.sigma_m; });
    if (pairs.size() > options_.most_pairs) pairs.resize(options_.most_pairs);
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
    if (hypothesis->log_odds > best_ - options_.log_odds_range) found_.push_back(*hypothesis);
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

  /// Eq. 48: the pose that two points determine, and their weight.
  std::optional<PoseHypothesis> from_pair(const SightedPair& pair, LandmarkId first,
                                          LandmarkId second) const {
    const PointMatch ends[] = {match_of(*pair.first, map_[first]), match_of(*pair.second, map_[second])};
    const std::optional<PoseFit> fit = fit_pose(ends);
    if (!fit || fit->misfit > options_.gate) return std::nullopt;
    PoseHypothesis hypothesis{{fit->map_from_body, fit->covariance}};
    hypothesis.log_odds = -0.5 * (fit->misfit + fit->log_noise) - 2.0 * std::log(2.0 * kPi) +
                          0.5 * std::log(fit->covariance.determinant()) + 1.5 * std::log(2.0 * kPi) -
                          log_space_;
    for (const SightedPoint* point : {pair.first, pair.second})
      hypothesis.log_odds += log_landmark(*point, hypothesis.pose) - log_chance(*point);
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
      hypothesis.log_odds += gain / repeats_[i];
    }
  }

  /// Points in one place are one supporting landmark: how many there are.
  double repeats_of(const SightedPoint& point) const {
    return static_cast<double>(std::ranges::count_if(
        seen_.points(), [&](const SightedPoint& p) { return are_one_place(p, point); }));
  }

  /// Improves the hypothesis by a point, if a landmark fits that no other point has taken; returns the
  /// point's log density then, else −∞.
  double take(PoseHypothesis& hypothesis, const SightedPoint& point, std::vector<LandmarkId>& taken) const {
    PoseEstimate& pose = hypothesis.pose;
    double best = options_.gate;
    std::optional<PointInnovation> chosen;
    LandmarkId landmark = kUnknownLandmark;
    Matrix2 S_chosen;
    for (const LandmarkId id : candidates(pose, point)) {
      if (std::ranges::find(taken, id) != taken.end()) continue;
      const PointInnovation innovation = point_innovation(pose.pose, match_of(point, map_[id]));
      const Matrix2 S = innovation.H * pose.covariance * innovation.H.transpose() + innovation.noise;
      const double squared = innovation.residual.dot(S.llt().solve(innovation.residual));
      if (squared > best) continue;
      best = squared;
      chosen = innovation;
      landmark = id;
      S_chosen = S;
    }
    if (!chosen) return -std::numeric_limits<double>::infinity();
    const Eigen::Matrix<double, 3, 2> K = pose.covariance * chosen->H.transpose() * S_chosen.inverse();
    const Vector3 change = K * chosen->residual;
    pose.pose = {pose.pose.x + change.x(), pose.pose.y + change.y(), pose.pose.heading + change.z()};
    // Joseph's form: what is much surer afterwards is no difference of large numbers.
    const Matrix3 A = Matrix3::Identity() - K * chosen->H;
    pose.covariance = (A * pose.covariance * A.transpose() + K * chosen->noise * K.transpose()).eval();
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
        return is_same_place(other.pose.pose, candidate.pose.pose, options_.same);
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
  double log_space_;             ///< of the poses that there are
  std::vector<double> repeats_;  ///< of each point: how many are in its place
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

bool is_same_place(const Pose2& a, const Pose2& b, const SamePlace& same) {
  const Pose2 apart = a.inverse() * b;
  return apart.translation().norm() < same.place_m && std::abs(wrap_angle(apart.heading)) < same.heading_rad;
}

}  // namespace trundle::slam
