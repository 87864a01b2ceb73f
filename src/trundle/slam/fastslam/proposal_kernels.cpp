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
struct LaneCholesky {
  Vec<float> xx, yx, yy, hx, hy, hh;
  Vec<float> inverse_xx, inverse_yy, inverse_hh;

  explicit LaneCholesky(const LaneSymmetric& A) {
    const Vec<float> one = lanes<float>(1.0);
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
  LaneTriple forward(const LaneTriple& v) const {
    const Vec<float> x = v.x * inverse_xx;
    const Vec<float> y = (v.y - yx * x) * inverse_yy;
    return {x, y, (v.h - hx * x - hy * y) * inverse_hh};
  }
  /// C⁻ᵀ v
  LaneTriple backward(const LaneTriple& v) const {
    const Vec<float> h = v.h * inverse_hh;
    const Vec<float> y = (v.y - hy * h) * inverse_yy;
    return {(v.x - yx * y - hx * h) * inverse_xx, y, h};
  }
};

/// What the sightings say of a twist of the sensor, linearised where it stands.
struct LaneNormalEquations {
  LaneSymmetric information;
  LaneTriple gradient;
  Vec<float> curving;  ///< greatest of (information of one reading) / range², an upper bound
  Vec<float> weight;   ///< greatest information of one reading
};

HWY_INLINE LaneNormalEquations normal_equations(std::span<const NearReading> readings,
                                                const LaneSensor& sensor, std::size_t i) {
  using V = Vec<float>;
  const V zero = hn::Zero(Tag<float>());
  LaneNormalEquations sum = {{zero, zero, zero, zero, zero, zero}, {zero, zero, zero}, zero, zero};
  LaneSymmetric& I = sum.information;
  for (const NearReading& reading : readings) {
    const LandmarkColumns& columns = *reading.landmark;
    const LaneSight s = sight_of(sensor, reading, load_landmark(columns.numbers() + i, columns.stride()));
    const LaneShift shift = weighted_innovation(s);
    const LaneDirection at = direction_of(sensor, s);
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

struct LaneGaussian {
  LaneTriple mean;
  LaneCholesky root;  ///< of the information
  Vec<float> bend2;   ///< squared error of the linearisation: see gaussian_at
};

/// One Gauss–Newton step from n, and the curvature there. Over a step of length d and turn t what was
/// linearised errs by less than d (d/range + t); `bend2` is that squared, in the readings' own σ.
HWY_INLINE LaneGaussian gaussian_at(std::span<const NearReading> readings, const LaneSensor& sensor,
                                    std::size_t i, const LaneMatrix& L, const LaneTriple& n) {
  const LaneNormalEquations by_twist = normal_equations(readings, sensor, i);
  const LaneTriple x = times(by_twist.information, L.columns[0]);
  const LaneTriple y = times(by_twist.information, L.columns[1]);
  const LaneTriple h = times(by_twist.information, L.columns[2]);
  const Vec<float> one = lanes<float>(1.0);
  const LaneCholesky root({one + dot(L.columns[0], x), dot(L.columns[0], y), dot(L.columns[0], h),
                           one + dot(L.columns[1], y), dot(L.columns[1], h), one + dot(L.columns[2], h)});
  const LaneTriple step = root.backward(root.forward(transposed_times(L, by_twist.gradient) - n));
  const LaneTriple twist = times(L, step);
  const Vec<float> length2 = twist.x * twist.x + twist.y * twist.y;
  return {n + step, root, length2 * (length2 * by_twist.curving + twist.h * twist.h * by_twist.weight)};
}

template <class Mask>
HWY_INLINE void replace(Mask mask, const LaneGaussian& by, LaneGaussian& g) {
  g.mean = where(mask, by.mean, g.mean);
  const auto put = [&](const Vec<float>& from, Vec<float>& to)
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
void gaussians(const NearReadings& near, const GaussianProposal& proposal, ParticleRange range,
               TripleColumns& n_columns, double* log_weights) {
  constexpr int kMostSteps = 4;  // what has not converged then is weighed as it is: any proposal is unbiased
  constexpr double kGreatestBend2 = 0.01;  // (0.1 σ)²: the linearisation errs by a tenth of a reading's noise
  constexpr double kFarthest = 1e6;        // [σ] beyond, numbers have failed and the motion has to do
  const std::span<const NearReading> readings = near.all();
  const LaneMatrix L = matrix(proposal.L);
  const Vec<float> zero = hn::Zero(Tag<float>());
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneSensor predicted = load_sensor(proposal.predicted, i);
    LaneTriple n = {zero, zero, zero};
    LaneSensor sensor = predicted;
    if (proposal.from != nullptr) {
      n = load_triple(*proposal.from, i);
      sensor = moved(predicted, times(L, n));
    }
    LaneGaussian g = gaussian_at(readings, sensor, i, L, n);
    for (int step = 1; step < kMostSteps; ++step) {
      const auto bends = g.bend2 > lanes<float>(kGreatestBend2);
      if (hn::AllFalse(Tag<float>(), bends)) break;
      n = g.mean;
      replace(bends, gaussian_at(readings, moved(predicted, times(L, n)), i, L, n), g);
    }
    const LaneTriple z = load_triple(proposal.z, i);
    n = g.mean + g.root.backward(z);
    const auto is_near = [](Vec<float> x) HWY_ATTR { return hn::Abs(x) < lanes<float>(kFarthest); };
    const auto is_sound = hn::And(hn::And(is_near(n.x), is_near(n.y)), is_near(n.h));
    const Vec<float> log_ratio = lanes<float>(0.5) * (dot(z, z) - dot(n, n)) +
                                 log(g.root.inverse_xx * g.root.inverse_yy * g.root.inverse_hh);
    store_triple(where(is_sound, n, z), n_columns, i);
    add(hn::IfThenElseZero(is_sound, log_ratio), log_weights + i);
  }
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
