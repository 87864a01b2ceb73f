#include "trundle/slam/localization/global_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/localization/pair_prediction.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

PointMatch match_of(const SightedPoint& point, const KnownLandmark& landmark) {
  return {point.in_body, point.covariance, landmark.position, landmark.covariance};
}

double log_normal(double squared_distance, const Matrix2& covariance) {
  return -0.5 * (squared_distance + std::log(covariance.determinant())) - std::log(2.0 * kPi);
}

/// A hypothesis, and which landmark each point shows by it.
struct Explanation {
  PoseHypothesis hypothesis;
  double misfit = 0.0;  ///< χ² of the points that show landmarks
  std::vector<LandmarkId> shown = {};
};

/// The hypotheses that one local map suggests.
class GlobalSearch {
 public:
  GlobalSearch(const LocalMap& seen, const KnownMap& map, const LandmarkSensor& sensor,
               const MapSightOptions& options)
      : seen_(seen),
        points_(seen.points()),
        map_(map),
        sensor_(sensor),
        options_(options),
        log_space_(std::log(2.0 * kPi * map.area_m2(sensor.max_range_m))),
        is_tried_(points_.size(), false) {
    for (const SightedPoint& point : points_) repeats_.push_back(repeats_of(point));
    for (std::size_t i = 0; i < points_.size(); ++i)
      most_gains_.push_back(is_usable(points_[i], map_) ? gain(i, log_normal(0.0, points_[i].covariance))
                                                        : 0.0);
  }

  FoundPoses run() {
    FoundPoses found;
    for (const SightedPair& pair : rarest_pairs(seen_, map_, options_)) {
      found.is_ambiguous = try_pair(pair);
      if (found.is_ambiguous) break;
      is_tried_[pair.first] = is_tried_[pair.second] = true;
    }
    for (const Explanation& kept : kept_)
      if (kept.hypothesis.log_odds > best_ - options_.log_odds_range) found.poses.push_back(finished(kept));
    return found;
  }

  double log_odds_at(const PoseEstimate& pose) const {
    Explanation here{.hypothesis = {pose}};
    here.shown.assign(points_.size(), kUnknownLandmark);
    PoseHypothesis& hypothesis = here.hypothesis;
    const auto& [place_m, heading_rad] = options_.same;
    hypothesis.pose.covariance =
        Vector3(place_m * place_m, place_m * place_m, heading_rad * heading_rad).asDiagonal();
    hypothesis.log_odds =
        0.5 * std::log(hypothesis.pose.covariance.determinant()) + 1.5 * std::log(2.0 * kPi) - log_space_;
    add_points(here, -std::numeric_limits<double>::infinity());
    return hypothesis.log_odds;
  }

 private:
  /// Whether so many places explain all that was seen that the others need not be tried.
  bool try_pair(const SightedPair& pair) {
    const std::optional<PairPrediction> prediction = prediction_of(pair, seen_, map_, options_);
    if (!prediction) return false;
    const LandmarkId first = points_[pair.first].landmark;
    const LandmarkId second = points_[pair.second].landmark;
    if (first != kUnknownLandmark && second != kUnknownLandmark)
      return try_landmarks(pair, *prediction, first, second);
    if (first != kUnknownLandmark)
      return try_around(pair, first,
                        [&](LandmarkId id) { return try_landmarks(pair, *prediction, first, id); });
    if (second != kUnknownLandmark)
      return try_around(pair, second,
                        [&](LandmarkId id) { return try_landmarks(pair, *prediction, id, second); });
    return std::ranges::any_of(map_.pairs(pair.low_m, pair.high_m), [&](const KnownMap::Pair& p) {
      return try_landmarks(pair, *prediction, p.first, p.second) ||
             try_landmarks(pair, *prediction, p.second, p.first);
    });
  }

  /// One of the landmarks is known, the other lies about as far away as it should.
  template <class Try>
  bool try_around(const SightedPair& pair, LandmarkId known, const Try& try_other) const {
    const Vector2& centre = map_[known].position;
    return map_.places().visit_until(centre, pair.high_m, [&](std::size_t number) {
      const auto other = static_cast<LandmarkId>(number);
      return other != known && (map_[other].position - centre).norm() >= pair.low_m && try_other(other);
    });
  }

  bool try_landmarks(const SightedPair& pair, const PairPrediction& prediction, LandmarkId first,
                     LandmarkId second) {
    if (is_explained(pair, first, second) || is_hopeless(pair, prediction, first, second)) return false;
    auto explanation = from_pair(pair, first, second);
    if (!explanation) return false;
    if (!add_points(*explanation, least_log_odds())) return false;
    keep(std::move(*explanation));
    return kept_.size() == kMostHypotheses &&
           std::ranges::all_of(kept_, [&](const Explanation& kept) { return explains_all(kept); });
  }

  /// By a hypothesis that two other points have led to.
  bool is_explained(const SightedPair& pair, LandmarkId first, LandmarkId second) const {
    return std::ranges::any_of(kept_, [&](const Explanation& kept) {
      return kept.shown[pair.first] == first && kept.shown[pair.second] == second;
    });
  }

  /// Nothing that matters has less.
  double least_log_odds() const {
    const double least = best_ - options_.log_odds_range;
    return kept_.size() < kMostHypotheses ? least : std::max(least, kept_.back().hypothesis.log_odds);
  }

  /// Of those in one place the more probable one, of all the most probable ones.
  void keep(Explanation explanation) {
    const PoseHypothesis& found = explanation.hypothesis;
    if (!(found.log_odds > least_log_odds())) return;
    const auto is_same = [&](const Explanation& kept) {
      return is_same_place(kept.hypothesis.pose.pose, found.pose.pose, options_.same);
    };
    const auto is_better = [&](const Explanation& kept) {
      return kept.hypothesis.log_odds >= found.log_odds;
    };
    const auto at = std::ranges::find_if_not(kept_, is_better);
    if (std::any_of(kept_.begin(), at, is_same)) return;
    best_ = std::max(best_, found.log_odds);
    kept_.erase(std::remove_if(at, kept_.end(), is_same), kept_.end());
    kept_.insert(at, std::move(explanation));
    if (kept_.size() > kMostHypotheses) kept_.pop_back();
  }

  /// Noise alone explains the misfit, and whatever it does not explain was looked for before: no pose that
  /// has not been tried yet explains more.
  bool explains_all(const Explanation& explanation) const {
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (explanation.shown[i] == kUnknownLandmark && is_usable(points_[i], map_) && !is_tried_[i])
        return false;
    const double freedom = 2.0 * static_cast<double>(explanation.hypothesis.matched) - 3.0;
    return explanation.misfit <= misfit_limit(freedom);
  }
  /// As improbable as the gate of one point is.
  double misfit_limit(double freedom) const {
    return chi_squared_limit(std::exp(-0.5 * options_.gate), freedom);
  }

  /// log of the density of a point that is no landmark of the map, or has a wrong name: anywhere in sight.
  double log_chance(const SightedPoint& point) const {
    const double names = point.landmark == kUnknownLandmark ? 1.0 : static_cast<double>(map_.size());
    return -std::log(kPi * sensor_.max_range_m * sensor_.max_range_m * names);
  }
  /// Of one that is: any of those in view, where it has no name.
  double log_landmark(const SightedPoint& point) const {
    const bool named = point.landmark != kUnknownLandmark;
    return std::log1p(-options_.outlier_share) - (named ? 0.0 : std::log(map_.most_in_view()));
  }
  /// Eq. 49 of one point, of which `log_density` is that of its landmark.
  double gain(std::size_t i, double log_density) const {
    const double log_ratio = log_density + log_landmark(points_[i]) - log_chance(points_[i]);
    return std::log(std::exp(log_ratio) + options_.outlier_share) / repeats_[i];
  }
  double loss(std::size_t i) const { return std::log(options_.outlier_share) / repeats_[i]; }

  /// Eq. 49a: were all landmarks that lie near enough exactly where they should be, it would still be too
  /// little.
  bool is_hopeless(const SightedPair& pair, const PairPrediction& prediction, LandmarkId first,
                   LandmarkId second) {
    const Vector2& from = map_[first].position;
    const Vector2& to = map_[second].position;
    const Baseline baseline = Baseline::between(from, to, prediction.share);
    const double mismatch = (to - from).norm() - pair.baseline_m;
    double most = prediction.log_most - log_space_ -
                  0.5 * mismatch * mismatch / (pair.variance() + 2.0 * map_.largest_variance());
    for (const std::size_t i : {pair.first, pair.second})
      most += log_landmark(points_[i]) - log_chance(points_[i]);
    for (const auto& expected : prediction.others) most += most_gains_[expected.point];
    const double least = least_log_odds();
    for (const auto& [i, at, radius_m] : prediction.others) {
      if (most <= least) return true;
      if (!may_show(points_[i], baseline * at, radius_m)) most += loss(i) - most_gains_[i];
    }
    return most <= least;
  }
  bool may_show(const SightedPoint& point, const Vector2& place, double radius_m) const {
    if (point.landmark == kUnknownLandmark) return map_.places().has_any_within(place, radius_m);
    return (map_[point.landmark].position - place).norm() <= radius_m;
  }

  /// Eq. 48: the pose that two points determine, and their weight.
  std::optional<Explanation> from_pair(const SightedPair& pair, LandmarkId first, LandmarkId second) const {
    const PointMatch ends[] = {match_of(points_[pair.first], map_[first]),
                               match_of(points_[pair.second], map_[second])};
    const std::optional<PoseFit> fit = fit_pose(ends);
    if (!fit || fit->misfit > options_.gate) return std::nullopt;
    Explanation explanation{.hypothesis = {{fit->map_from_body, fit->covariance}}};
    PoseHypothesis& hypothesis = explanation.hypothesis;
    hypothesis.log_odds = -0.5 * (fit->misfit + fit->log_noise) - 2.0 * std::log(2.0 * kPi) +
                          0.5 * std::log(fit->covariance.determinant()) + 1.5 * std::log(2.0 * kPi) -
                          log_space_;
    for (const std::size_t i : {pair.first, pair.second})
      hypothesis.log_odds += log_landmark(points_[i]) - log_chance(points_[i]);
    hypothesis.matched = 2;
    explanation.misfit = fit->misfit;
    explanation.shown.assign(points_.size(), kUnknownLandmark);
    explanation.shown[pair.first] = first;
    explanation.shown[pair.second] = second;
    return explanation;
  }

  /// Eq. 49: the points that are not of the pair, the newest first, each as a measurement of the pose or as
  /// no landmark. No landmark is two points. Returns false as soon as it can come to no more than `least`,
  /// with so much for each point at most.
  bool add_points(Explanation& explanation, double least) const {
    double to_come = 0.0;
    for (std::size_t i = 0; i < most_gains_.size(); ++i)
      if (explanation.shown[i] == kUnknownLandmark) to_come += most_gains_[i];
    double& log_odds = explanation.hypothesis.log_odds;
    for (std::size_t i = points_.size(); i-- > 0;) {
      if (explanation.shown[i] != kUnknownLandmark || !is_usable(points_[i], map_)) continue;
      log_odds += gain(i, take(explanation, i));
      to_come -= most_gains_[i];
      if (log_odds + to_come <= least) return false;
    }
    return true;
  }

  /// Points in one place are one supporting landmark: how many there are.
  double repeats_of(const SightedPoint& point) const {
    return static_cast<double>(
        std::ranges::count_if(points_, [&](const SightedPoint& p) { return are_one_place(p, point); }));
  }

  /// Eq. 47b: with the gain of each landmark, all linearised at the pose that came of them.
  PoseHypothesis finished(const Explanation& explanation) const {
    PoseHypothesis hypothesis = explanation.hypothesis;
    const Pose2& pose = hypothesis.pose.pose;
    Matrix3 information = Matrix3::Zero();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const LandmarkId landmark = explanation.shown[i];
      if (landmark == kUnknownLandmark) continue;
      const PointInnovation point = point_innovation(pose, match_of(points_[i], map_[landmark]));
      const Eigen::Matrix<double, 3, 2> weight = point.H.transpose() * point.noise.inverse();
      information += weight * point.H;
      hypothesis.made_of.push_back({landmark, -weight * rotation(-pose.heading)});
    }
    hypothesis.pose.covariance = information.inverse();
    for (LandmarkGain& gain : hypothesis.made_of)
      gain.by_landmark = hypothesis.pose.covariance * gain.by_landmark;
    return hypothesis;
  }

  /// Improves the hypothesis by a point, if a landmark fits that no other point has taken; returns the
  /// point's log density then, else −∞.
  double take(Explanation& explanation, std::size_t i) const {
    PoseEstimate& pose = explanation.hypothesis.pose;
    double best = options_.gate;
    std::optional<PointInnovation> chosen;
    LandmarkId landmark = kUnknownLandmark;
    Matrix2 S_chosen;
    const auto consider = [&](LandmarkId id) {
      if (std::ranges::find(explanation.shown, id) != explanation.shown.end()) return;
      const PointInnovation innovation = point_innovation(pose.pose, match_of(points_[i], map_[id]));
      const Matrix2 S = innovation.H * pose.covariance * innovation.H.transpose() + innovation.noise;
      const double squared = squared_mahalanobis(innovation.residual, S);
      if (squared > best) return;
      best = squared;
      chosen = innovation;
      landmark = id;
      S_chosen = S;
    };
    visit_candidates(pose, points_[i], consider);
    if (!chosen) return -std::numeric_limits<double>::infinity();
    update({chosen->residual, chosen->H, S_chosen, chosen->noise}, pose);
    ++explanation.hypothesis.matched;
    explanation.misfit += best;
    explanation.shown[i] = landmark;
    return log_normal(best, S_chosen);
  }

  /// Landmarks that may pass the gate.
  template <class Visit>
  void visit_candidates(const PoseEstimate& pose, const SightedPoint& point, const Visit& visit) const {
    if (point.landmark != kUnknownLandmark) return visit(point.landmark);
    const Vector2 place = pose.pose * point.in_body;
    const Matrix2 of_map = map_.largest_variance() * Matrix2::Identity();
    const PointMatch there{point.in_body, point.covariance, place, of_map};
    map_.places().visit_until(place, gate_radius(pose, point_innovation(pose.pose, there), options_.gate),
                              [&](std::size_t number) {
                                visit(static_cast<LandmarkId>(number));
                                return false;
                              });
  }

  const LocalMap& seen_;
  std::span<const SightedPoint> points_;
  const KnownMap& map_;
  const LandmarkSensor& sensor_;
  const MapSightOptions& options_;
  double log_space_;                ///< of the poses that there are
  std::vector<double> repeats_;     ///< of each point: how many are in its place
  std::vector<double> most_gains_;  ///< of each point, were its landmark exactly where it should be
  std::vector<bool> is_tried_;      ///< of each point: all hypotheses from a pair with it
  std::vector<Explanation> kept_;   ///< the most probable first
  double best_ = 0.0;               ///< log odds of the best one found, or of none
};

}  // namespace

FoundPoses find_poses(const LocalMap& seen, const KnownMap& map, const LandmarkSensor& sensor,
                      const MapSightOptions& options) {
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
