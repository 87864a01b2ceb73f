#include "trundle/slam/fastslam/proposal_kernels.hpp"

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/fastslam/proposal_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/fastslam/lane_sight.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Lower C with C Cᵀ = A, A − 1 positive semidefinite: so no pivot is less than 1, whatever rounding says.
template <class Real>
struct LaneCholesky {
  Vec<Real> xx, yx, yy, hx, hy, hh;
  Vec<Real> inverse_xx, inverse_yy, inverse_hh;

  explicit LaneCholesky(const LaneSymmetric<Real>& A) {
    const Vec<Real> one = lanes<Real>(1.0);
    xx = hn::Sqrt(hn::Max(A.xx, one));
    inverse_xx = one / xx;
    yx = A.xy * inverse_xx;
    hx = A.xh * inverse_xx;
    yy = hn::Sqrt(hn::Max(A.yy - yx * yx, one));
    inverse_yy = one / yy;
    hy = (A.yh - hx * yx) * inverse_yy;
    hh = hn::Sqrt(hn::Max(A.hh - hx * hx - hy * hy, one));
    inverse_hh = one / hh;
  }
  /// C⁻¹ v
  LaneTriple<Real> forward(const LaneTriple<Real>& v) const {
    const Vec<Real> x = v.x * inverse_xx;
    const Vec<Real> y = (v.y - yx * x) * inverse_yy;
    return {x, y, (v.h - hx * x - hy * y) * inverse_hh};
  }
  /// C⁻ᵀ v
  LaneTriple<Real> backward(const LaneTriple<Real>& v) const {
    const Vec<Real> h = v.h * inverse_hh;
    const Vec<Real> y = (v.y - hy * h) * inverse_yy;
    return {(v.x - yx * y - hx * h) * inverse_xx, y, h};
  }
};

/// What the sightings say of a twist of the sensor, linearised where it stands.
template <class Real>
struct LaneNormalEquations {
  LaneSymmetric<Real> information;
  LaneTriple<Real> gradient;
  Vec<Real> curving;  ///< greatest of (information of one reading) / range², an upper bound
  Vec<Real> weight;   ///< greatest information of one reading
};

template <class Real>
HWY_INLINE LaneNormalEquations<Real> normal_equations(std::span<const NearReading<Real>> readings,
                                                      const LaneSensor<Real>& sensor, std::size_t i) {
  using V = Vec<Real>;
  const V zero = hn::Zero(Tag<Real>());
  LaneNormalEquations<Real> sum = {{zero, zero, zero, zero, zero, zero}, {zero, zero, zero}, zero, zero};
  LaneSymmetric<Real>& I = sum.information;
  for (const NearReading<Real>& reading : readings) {
    const LandmarkColumns& columns = *reading.landmark;
    const LaneSight<Real> s =
        sight_of(sensor, reading, load_landmark(columns.template numbers<Real>() + i, columns.stride()));
    const LaneShift<Real> shift = weighted_innovation(s);
    const LaneDirection<Real> at = direction_of(sensor, s);
    const V aa = s.s_across * s.inverse_determinant;  // S'⁻¹
    const V ac = zero - s.p_mixed * s.inverse_determinant;
    const V cc = s.s_along * s.inverse_determinant;
    const V cos2 = at.cos * at.cos;
    const V sin2 = at.sin * at.sin;
    const V sin_cos = at.sin * at.cos;
    const V mixed = (ac + ac) * sin_cos;
    I.xx = I.xx + (aa * cos2 + cc * sin2 - mixed);
    I.yy = I.yy + (aa * sin2 + cc * cos2 + mixed);
    I.xy = I.xy + ((aa - cc) * sin_cos + ac * (cos2 - sin2));
    I.xh = I.xh + s.range * (ac * at.cos - cc * at.sin);
    I.yh = I.yh + s.range * (ac * at.sin + cc * at.cos);
    I.hh = I.hh + cc * s.range * s.range;
    sum.gradient.x = sum.gradient.x - (at.cos * shift.along - at.sin * shift.across);
    sum.gradient.y = sum.gradient.y - (at.sin * shift.along + at.cos * shift.across);
    sum.gradient.h = sum.gradient.h - s.range * shift.across;
    const V trace = aa + cc;
    sum.weight = hn::Max(sum.weight, trace);
    sum.curving = hn::Max(sum.curving, trace * s.inverse_range * s.inverse_range);
  }
  return sum;
}

template <class Real>
struct LaneGaussian {
  LaneTriple<Real> mean;
  LaneCholesky<Real> root;  ///< of the information
  Vec<Real> bend2;          ///< squared error of the linearisation: see gaussian_at
};

/// One Gauss–Newton step from n, and the curvature there. Over a step of length d and turn t what was
/// linearised errs by less than d (d/range + t); `bend2` is that squared, in the readings' own σ.
template <class Real>
HWY_INLINE LaneGaussian<Real> gaussian_at(std::span<const NearReading<Real>> readings,
                                          const LaneSensor<Real>& sensor, std::size_t i,
                                          const LaneMatrix<Real>& L, const LaneTriple<Real>& n) {
  const LaneNormalEquations<Real> by_twist = normal_equations(readings, sensor, i);
  const LaneTriple<Real> x = times(by_twist.information, L.columns[0]);
  const LaneTriple<Real> y = times(by_twist.information, L.columns[1]);
  const LaneTriple<Real> h = times(by_twist.information, L.columns[2]);
  const Vec<Real> one = lanes<Real>(1.0);
  const LaneCholesky<Real> root({one + dot(L.columns[0], x), dot(L.columns[0], y), dot(L.columns[0], h),
                                 one + dot(L.columns[1], y), dot(L.columns[1], h),
                                 one + dot(L.columns[2], h)});
  const LaneTriple<Real> step = root.backward(root.forward(transposed_times(L, by_twist.gradient) - n));
  const LaneTriple<Real> twist = times(L, step);
  const Vec<Real> length2 = twist.x * twist.x + twist.y * twist.y;
  return {n + step, root, length2 * (length2 * by_twist.curving + twist.h * twist.h * by_twist.weight)};
}

template <class Real, class Mask>
HWY_INLINE LaneTriple<Real> chosen(Mask mask, const LaneTriple<Real>& yes, const LaneTriple<Real>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.h, no.h)};
}

template <class Real, class Mask>
HWY_INLINE void replace(Mask mask, const LaneGaussian<Real>& by, LaneGaussian<Real>& g) {
  g.mean = chosen(mask, by.mean, g.mean);
  const auto put = [&](const Vec<Real>& from, Vec<Real>& to)
                       HWY_ATTR { to = hn::IfThenElse(mask, from, to); };
  put(by.bend2, g.bend2);
  put(by.root.xx, g.root.xx);
  put(by.root.yx, g.root.yx);
  put(by.root.yy, g.root.yy);
  put(by.root.hx, g.root.hx);
  put(by.root.hy, g.root.hy);
  put(by.root.hh, g.root.hh);
  put(by.root.inverse_xx, g.root.inverse_xx);
  put(by.root.inverse_yy, g.root.inverse_yy);
  put(by.root.inverse_hh, g.root.inverse_hh);
}

// Eq. 16. A lane whose step was short enough keeps its Gaussian while others go on: no lane sees what stands
// beside it.
template <class Real>
void gaussians_as(std::span<const NearReading<Real>> readings, const GaussianProposal& proposal,
                  ParticleRange range, TripleColumns& n_columns, double* log_weights) {
  constexpr int kMostSteps = 4;  // what has not converged then is weighed as it is: any proposal is unbiased
  constexpr double kGreatestBend2 = 0.01;  // (0.1 σ)²: the linearisation errs by a tenth of a reading's noise
  constexpr double kFarthest = 1e6;        // [σ] beyond, numbers have failed and the motion has to do
  const LaneMatrix<Real> L = matrix<Real>(proposal.L);
  const Vec<Real> zero = hn::Zero(Tag<Real>());
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneSensor<Real> predicted = load_sensor<Real>(proposal.predicted, i);
    LaneTriple<Real> n = {zero, zero, zero};
    LaneSensor<Real> sensor = predicted;
    if (proposal.from != nullptr) {
      n = load_triple<Real>(*proposal.from, i);
      sensor = moved(predicted, times(L, n));
    }
    LaneGaussian<Real> g = gaussian_at(readings, sensor, i, L, n);
    for (int step = 1; step < kMostSteps; ++step) {
      const auto bends = g.bend2 > lanes<Real>(kGreatestBend2);
      if (hn::AllFalse(Tag<Real>(), bends)) break;
      n = g.mean;
      replace(bends, gaussian_at(readings, moved(predicted, times(L, n)), i, L, n), g);
    }
    const LaneTriple<Real> z = load_triple<Real>(proposal.z, i);
    n = g.mean + g.root.backward(z);
    const auto is_near = [](Vec<Real> x) HWY_ATTR { return hn::Abs(x) < lanes<Real>(kFarthest); };
    const auto is_sound = hn::And(hn::And(is_near(n.x), is_near(n.y)), is_near(n.h));
    const Vec<Real> log_ratio = lanes<Real>(0.5) * (dot(z, z) - dot(n, n)) +
                                log(g.root.inverse_xx * g.root.inverse_yy * g.root.inverse_hh);
    store_triple(chosen(is_sound, n, z), n_columns, i);
    add<Real>(hn::IfThenElseZero(is_sound, log_ratio), log_weights + i);
  }
}

void gaussians(const NearReadings& readings, const GaussianProposal& proposal, ParticleRange range,
               TripleColumns& n, double* log_weights) {
  if (readings.precision() == Precision::float32)
    gaussians_as(readings.in<float>(), proposal, range, n, log_weights);
  else
    gaussians_as(readings.in<double>(), proposal, range, n, log_weights);
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(gaussians);

void draw_from_gaussians(const NearReadings& readings, const GaussianProposal& proposal, ParticleRange range,
                         TripleColumns& n, double* log_weights) {
  HWY_DYNAMIC_DISPATCH(gaussians)(readings, proposal, range, n, log_weights);
}

}  // namespace trundle::slam
#endif
