#include "trundle/slam/particles/choice_kernels.hpp"

#include "trundle/slam/particles/lane_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/particles/choice_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/particles/lane_sight.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::HWY_NAMESPACE {

HWY_INLINE void store_choices(Vec<float> x, std::int32_t* to) {
  const hn::RebindToSigned<Tag<float>> d;
  hn::Store(hn::ConvertTo(d, x), d, to);
}
HWY_INLINE void store_choices(Vec<double> x, std::int32_t* to) {
  const hn::Rebind<std::int32_t, Tag<double>> d;
  hn::Store(hn::DemoteTo(d, x), d, to);
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

template <class Real>
void take_as(const std::int32_t* choices, const Candidate& from, ParticleRange range, LandmarkColumns& to) {
  const Tag<Real> d;
  const Vector2 apart = from.columns->origin() - to.origin();
  const Vec<Real> zero = hn::Zero(d);
  const std::array<Vec<Real>, LandmarkColumns::kColumns> shift = {lanes<Real>(apart.x()),
                                                                  lanes<Real>(apart.y()), zero, zero, zero};
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const auto mask = is_choice(d, choices + i, static_cast<std::int32_t>(from.landmark));
    if (hn::AllFalse(d, mask)) continue;
    for (std::size_t k = 0; k < LandmarkColumns::kColumns; ++k) {
      const Vec<Real> x = hn::Load(d, from.columns->numbers<Real>() + k * from.columns->stride() + i);
      Real* const place = to.numbers<Real>() + k * to.stride() + i;
      hn::Store(hn::IfThenElse(mask, x + shift[k], hn::Load(d, place)), d, place);
    }
  }
}

void take(const std::int32_t* choices, const Candidate& from, ParticleRange range, LandmarkColumns& to) {
  if (to.precision() == Precision::float32)
    take_as<float>(choices, from, range, to);
  else
    take_as<double>(choices, from, range, to);
}

/// What one reading costs a group of particles, for each candidate: −2 log p, where they may choose it.
template <class Real>
struct LaneCosts {
  std::array<bool, kMostCandidates> is_possible;  ///< for any of them
  std::array<Vec<Real>, kMostCandidates> of;      ///< where it is
  Vec<Real> least;                                ///< of these and of a new landmark
  Vec<Real> otherwise;                            ///< kFresh or kDoubtful
};

template <class Real>
HWY_INLINE LaneCosts<Real> costs_of(const ReadingTerms& reading, std::span<const Candidate> candidates,
                                    const Choosing& choosing, Vec<Real> of_new, std::size_t i) {
  const AssociationOptions& options = choosing.options;
  const LaneSymmetric<Real> Q = symmetric<Real>(choosing.sensor_covariance);
  const LaneSensor<Real> sensor = load_sensor<Real>(choosing.sensors, i);
  const Vec<Real> gate = lanes<Real>(options.gate);
  const Vec<Real> zero = hn::Zero(Tag<Real>());
  LaneCosts<Real> costs;
  costs.least = of_new;
  costs.otherwise = lanes<Real>(kFresh);
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const LandmarkColumns& columns = *candidates[c].columns;
    const LaneLandmark<Real> m = load_landmark<Real>(columns.numbers<Real>() + i, columns.stride());
    const LaneSight<Real> s =
        sight_of(sensor, near<Real>({reading, candidates[c].columns}, choosing.sensors.origin), m);
    const LaneTotal<Real> S = total_covariance(Q, sensor, s);
    const Vec<Real> nis = nis_of(s, S);
    const auto passes = hn::And(m.xx >= zero, nis <= gate);
    const auto is_near =
        hn::And(hn::And(m.xx >= zero, nis > gate), nis <= lanes<Real>(options.doubt * options.gate));
    costs.otherwise = hn::IfThenElse(is_near, lanes<Real>(kDoubtful), costs.otherwise);
    costs.is_possible[c] = !hn::AllFalse(Tag<Real>(), passes);
    if (!costs.is_possible[c]) continue;
    const Vec<Real> cost = nis + log<Real>(S.determinant * s.inverse_range * s.inverse_range) +
                           lanes<Real>(2.0 * std::log(2.0 * kPi));
    costs.of[c] = hn::IfThenElse(passes, cost, lanes<Real>(1e9));
    costs.least = hn::Min(costs.least, costs.of[c]);
  }
  return costs;
}

// Eq. 54.
template <class Real>
void choices_as(const ReadingTerms& reading, std::span<const Candidate> candidates, const Choosing& choosing,
                ParticleRange range, std::int32_t* choices) {
  const Vec<Real> half = lanes<Real>(-0.5);
  const Vec<Real> of_new = lanes<Real>(cost_of_new(choosing.options));
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneCosts<Real> costs = costs_of<Real>(reading, candidates, choosing, of_new, i);
    const auto log_share = [&](Vec<Real> cost) HWY_ATTR { return half * (cost - costs.least); };
    const Vec<Real> none = exp(log_share(of_new));
    std::array<Vec<Real>, kMostCandidates> share;
    Vec<Real> all = none;
    for (std::size_t c = 0; c < candidates.size(); ++c)
      if (costs.is_possible[c]) all = all + (share[c] = exp(log_share(costs.of[c])));
    Vec<Real> left = load<Real>(choosing.chance + i) * all - none;
    Vec<Real> choice = costs.otherwise;
    Vec<Real> log_chosen = log_share(of_new);
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (!costs.is_possible[c]) continue;
      const auto takes = hn::And(left >= hn::Zero(Tag<Real>()), share[c] > hn::Zero(Tag<Real>()));
      choice = hn::IfThenElse(takes, lanes<Real>(candidates[c].landmark), choice);
      log_chosen = hn::IfThenElse(takes, log_share(costs.of[c]), log_chosen);
      left = left - share[c];
    }
    store_choices(choice, choices + i);
    add<Real>(log<Real>(all) - log_chosen, choosing.log_weights + i);
  }
}

void choices_of(const ReadingTerms& reading, std::span<const Candidate> candidates, const Choosing& choosing,
                ParticleRange range, std::int32_t* choices) {
  if (candidates.front().columns->precision() == Precision::float32)
    choices_as<float>(reading, candidates, choosing, range, choices);
  else
    choices_as<double>(reading, candidates, choosing, range, choices);
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
  if (landmark.precision() == Precision::float64)
    return share_where(weights, [&](std::size_t i) HWY_ATTR {
      return hn::Load(d, landmark.numbers<double>() + xx + i) >= zero;
    });
  return share_where(weights, [&](std::size_t i) HWY_ATTR {
    const hn::Rebind<float, Tag<double>> narrow;
    return hn::PromoteTo(d, hn::Load(narrow, landmark.numbers<float>() + xx + i)) >= zero;
  });
}

}  // namespace trundle::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle {

HWY_EXPORT(take);
HWY_EXPORT(choices_of);
HWY_EXPORT(share_choosing);
HWY_EXPORT(share_having);

void choose_landmarks(const ReadingTerms& reading, std::span<const Candidate> candidates,
                      const Choosing& choosing, ParticleRange range, std::int32_t* choices) {
  if (candidates.empty())
    std::fill(choices + range.first, choices + range.last, kFresh);
  else
    HWY_DYNAMIC_DISPATCH(choices_of)(reading, candidates, choosing, range, choices);
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

}  // namespace trundle
#endif
