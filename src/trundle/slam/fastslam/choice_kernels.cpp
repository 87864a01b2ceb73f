#include "trundle/slam/fastslam/choice_kernels.hpp"

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/fastslam/choice_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/fastslam/lane_sight.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

HWY_INLINE void store_choices(Vec<float> x, std::int32_t* to) {
  const hn::RebindToSigned<Tag<float>> d;
  hn::Store(hn::ConvertTo(d, x), d, to);
}

HWY_INLINE hn::Mask<Tag<float>> is_choice(Tag<float> d, const std::int32_t* choices, std::int32_t chosen) {
  const hn::RebindToSigned<Tag<float>> di;
  return hn::RebindMask(d, hn::Load(di, choices) == hn::Set(di, chosen));
}
HWY_INLINE hn::Mask<Tag<double>> is_choice(Tag<double> d, const std::int32_t* choices, std::int32_t chosen) {
  const hn::RebindToSigned<Tag<double>> di;
  const hn::Rebind<std::int32_t, Tag<double>> narrow;
  return hn::RebindMask(d, hn::PromoteTo(di, hn::Load(narrow, choices)) == hn::Set(di, chosen));
}

void take(const std::int32_t* choices, const Candidate& from, ParticleRange range, LandmarkColumns& to) {
  const Tag<float> d;
  const Vector2 apart = from.columns->origin() - to.origin();
  const Vec<float> zero = hn::Zero(d);
  const std::array<Vec<float>, LandmarkColumns::kColumns> shift = {lanes<float>(apart.x()),
                                                                   lanes<float>(apart.y()), zero, zero, zero};
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const auto mask = is_choice(d, choices + i, static_cast<std::int32_t>(from.landmark));
    if (hn::AllFalse(d, mask)) continue;
    for (std::size_t k = 0; k < LandmarkColumns::kColumns; ++k) {
      const Vec<float> x = hn::Load(d, from.columns->numbers() + k * from.columns->stride() + i);
      float* const place = to.numbers() + k * to.stride() + i;
      hn::Store(hn::IfThenElse(mask, x + shift[k], hn::Load(d, place)), d, place);
    }
  }
}

/// What a candidate costs each particle.
void set_costs(const KnownReading& known, const Choosing& choosing, ParticleRange range, double* costs) {
  const LandmarkColumns& columns = *known.landmark;
  const NearReading reading = near(known, choosing.sensors.origin);
  const LaneSymmetric Q = symmetric(choosing.sensor_covariance);
  const bool is_drawn = choosing.sensor_covariance.isZero(0.0);  // fastslam1: the pose is no longer unsure
  const Vec<float> gate = lanes<float>(choosing.options.gate);
  const Vec<float> end_of_near = lanes<float>(choosing.options.near * choosing.options.gate);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneSensor sensor = load_sensor(choosing.sensors, i);
    const LaneLandmark m = load_landmark(columns.numbers() + i, columns.stride());
    const LaneSight s = sight_of(sensor, reading, m);
    const LaneTotal S = is_drawn ? LaneTotal{s.s_along, s.p_mixed, s.s_across, s.determinant}
                                 : total_covariance(Q, sensor, s);
    const Vec<float> nis = nis_of(s, S);
    const auto is_there = m.xx >= hn::Zero(Tag<float>());
    const auto passes = hn::And(is_there, nis <= gate);
    const auto is_near = hn::And(is_there, nis <= end_of_near);
    Vec<float> cost = hn::IfThenElse(is_near, lanes<float>(kNear), lanes<float>(kFar));
    if (!hn::AllFalse(Tag<float>(), passes)) {
      const Vec<float> inside = nis + log(S.determinant * s.inverse_range * s.inverse_range) +
                                lanes<float>(2.0 * std::log(2.0 * kPi));
      cost = hn::IfThenElse(passes, inside, cost);
    }
    store(cost, costs + i);
  }
}

/// What the candidates cost a group of particles.
struct LaneCosts {
  std::array<bool, kMostCandidates> is_possible;  ///< for any of them
  std::array<Vec<float>, kMostCandidates> of;     ///< where it is
  Vec<float> least;                               ///< of these and of a new landmark
  Vec<float> otherwise;                           ///< kNewLandmark or kAmbiguousLandmark
};

HWY_INLINE LaneCosts load_costs(const Hypotheses& of, Vec<float> of_new, std::size_t i) {
  LaneCosts costs;
  costs.least = of_new;
  costs.otherwise = lanes<float>(kNewLandmark);
  for (std::size_t c = 0; c < of.candidates.size(); ++c) {
    const Vec<float> cost = load(of.costs_of(c) + i);
    const auto is_near = cost == lanes<float>(kNear);
    costs.otherwise = hn::IfThenElse(is_near, lanes<float>(kAmbiguousLandmark), costs.otherwise);
    costs.is_possible[c] = !hn::AllFalse(Tag<float>(), cost < lanes<float>(kFar));
    costs.of[c] = cost;
    costs.least = hn::Min(costs.least, cost);
  }
  return costs;
}

// Eq. 54.
void choices_of(const ReadingTerms& reading, const Choosing& choosing, ParticleRange range, Hypotheses& of) {
  for (std::size_t c = 0; c < of.candidates.size(); ++c)
    set_costs({reading, of.candidates[c].columns}, choosing, range, of.costs_of(c));
  const Vec<float> half = lanes<float>(-0.5);
  const Vec<float> of_new = lanes<float>(cost_of_new(choosing.options));
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneCosts costs = load_costs(of, of_new, i);
    const auto log_share = [&](Vec<float> cost) HWY_ATTR { return half * (cost - costs.least); };
    const Vec<float> none = exp(log_share(of_new));
    std::array<Vec<float>, kMostCandidates> share;
    Vec<float> all = none;
    for (std::size_t c = 0; c < of.candidates.size(); ++c) {
      if (!costs.is_possible[c]) continue;
      const bool is_least = hn::AllTrue(Tag<float>(), costs.of[c] == costs.least);  // of most groups one is
      share[c] = is_least ? lanes<float>(1.0) : exp(log_share(costs.of[c]));
      all = all + share[c];
    }
    Vec<float> left = load(choosing.chance + i) * all - none;
    Vec<float> choice = costs.otherwise;
    Vec<float> log_chosen = log_share(of_new);
    for (std::size_t c = 0; c < of.candidates.size(); ++c) {
      if (!costs.is_possible[c]) continue;
      const auto takes = hn::And(left >= hn::Zero(Tag<float>()), share[c] > hn::Zero(Tag<float>()));
      choice = hn::IfThenElse(takes, lanes<float>(of.candidates[c].landmark), choice);
      log_chosen = hn::IfThenElse(takes, log_share(costs.of[c]), log_chosen);
      left = left - share[c];
    }
    store_choices(choice, of.choices.data() + i);
    add(log(all) - log_chosen, choosing.log_weights + i);
  }
}

/// Weight of the particles of which something holds; what pads has none.
template <class Holds>
HWY_INLINE double share_where(const Column<double>& weights, Holds holds) {
  const Tag<double> d;
  ColumnSums sums;
  for (std::size_t i = 0; i < weights.size(); i += hn::Lanes(d))
    sums.add(i % kParticleLanes, hn::IfThenElseZero(holds(i), hn::Load(d, weights.data() + i)));
  return sums.sum();
}

double share_choosing(std::int32_t choice, const std::int32_t* choices, const Column<double>& weights) {
  const Tag<double> d;
  return share_where(weights, [&](std::size_t i) HWY_ATTR { return is_choice(d, choices + i, choice); });
}

double share_having(const LandmarkColumns& landmark, const Column<double>& weights) {
  const Tag<double> d;
  const Wide zero = hn::Zero(d);
  const std::size_t xx = 2 * landmark.stride();
  return share_where(weights, [&](std::size_t i) HWY_ATTR {
    const hn::Rebind<float, Tag<double>> narrow;
    return hn::PromoteTo(d, hn::Load(narrow, landmark.numbers() + xx + i)) >= zero;
  });
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(take);
HWY_EXPORT(choices_of);
HWY_EXPORT(share_choosing);
HWY_EXPORT(share_having);

void choose_landmarks(const ReadingTerms& reading, const Choosing& choosing, ParticleRange range,
                      Hypotheses& of) {
  if (of.candidates.empty())
    std::fill(of.choices.data() + range.first, of.choices.data() + range.last, kNewLandmark);
  else
    HWY_DYNAMIC_DISPATCH(choices_of)(reading, choosing, range, of);
}

void take_chosen(const std::int32_t* choices, const Candidate& from, ParticleRange range,
                 LandmarkColumns& to) {
  HWY_DYNAMIC_DISPATCH(take)(choices, from, range, to);
}

double share_that_chose(std::int32_t choice, const Column<std::int32_t>& choices,
                        const Column<double>& weights) {
  return HWY_DYNAMIC_DISPATCH(share_choosing)(choice, choices.data(), weights);
}

double share_that_has(const LandmarkColumns& landmark, const Column<double>& weights) {
  return HWY_DYNAMIC_DISPATCH(share_having)(landmark, weights);
}

}  // namespace trundle::slam
#endif
