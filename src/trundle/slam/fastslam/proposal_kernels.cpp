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

/// Lower C of C Cᵀ = A.
struct LaneCholesky {
  LaneTriple inverse_diagonal;
  Vec<float> yx, hx, hy;

  /// C⁻¹ v
  LaneTriple forward(const LaneTriple& v) const {
    const Vec<float> x = v.x * inverse_diagonal.x;
    const Vec<float> y = (v.y - yx * x) * inverse_diagonal.y;
    return {x, y, (v.h - hx * x - hy * y) * inverse_diagonal.h};
  }
  /// C⁻ᵀ v
  LaneTriple backward(const LaneTriple& v) const {
    const Vec<float> h = v.h * inverse_diagonal.h;
    const Vec<float> y = (v.y - hy * h) * inverse_diagonal.y;
    return {(v.x - yx * y - hx * h) * inverse_diagonal.x, y, h};
  }
};

/// A − 1 is positive semidefinite: so no pivot is less than 1, whatever rounding says.
HWY_INLINE LaneCholesky cholesky(const LaneSymmetric& A) {
  const Vec<float> one = lanes<float>(1.0);
  LaneCholesky C;
  C.inverse_diagonal.x = one / hn::Sqrt(hn::Max(A.xx, one));
  C.yx = A.xy * C.inverse_diagonal.x;
  C.hx = A.xh * C.inverse_diagonal.x;
  C.inverse_diagonal.y = one / hn::Sqrt(hn::Max(A.yy - C.yx * C.yx, one));
  C.hy = (A.yh - C.hx * C.yx) * C.inverse_diagonal.y;
  C.inverse_diagonal.h = one / hn::Sqrt(hn::Max(A.hh - C.hx * C.hx - C.hy * C.hy, one));
  return C;
}

/// What the sightings say of a twist of the sensor, linearised where it stands.
struct LaneNormalEquations {
  LaneSymmetric information;
  LaneTriple gradient;
  Vec<float> by_length;  ///< greatest of (information of one reading) / range², an upper bound
  Vec<float> by_turn;    ///< greatest information of one reading
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
    sum.by_turn = hn::Max(sum.by_turn, trace);
    sum.by_length = hn::Max(sum.by_length, trace * s.inverse_range * s.inverse_range);
  }
  return sum;
}

struct LaneGaussian {
  LaneTriple mean;
  LaneCholesky root;      ///< of the information
  Vec<float> nonlinear2;  ///< squared error of the linearisation over the step to the mean
};

template <class Mask>
HWY_INLINE LaneGaussian where(Mask mask, const LaneGaussian& yes, const LaneGaussian& no) {
  const LaneCholesky &a = yes.root, &b = no.root;
  return {where(mask, yes.mean, no.mean),
          {where(mask, a.inverse_diagonal, b.inverse_diagonal), hn::IfThenElse(mask, a.yx, b.yx),
           hn::IfThenElse(mask, a.hx, b.hx), hn::IfThenElse(mask, a.hy, b.hy)},
          hn::IfThenElse(mask, yes.nonlinear2, no.nonlinear2)};
}

/// One Gauss–Newton step on eq. 15 from n, and the curvature there. Over a step of length d and turn t what
/// was linearised errs by less than d (d/range + t), in the readings' own σ.
HWY_INLINE LaneGaussian gauss_newton(std::span<const NearReading> readings, const LaneSensor& sensor,
                                     std::size_t i, const LaneMatrix& L, const LaneTriple& n) {
  const LaneNormalEquations by_twist = normal_equations(readings, sensor, i);
  const LaneTriple x = times(by_twist.information, L.columns[0]);
  const LaneTriple y = times(by_twist.information, L.columns[1]);
  const LaneTriple h = times(by_twist.information, L.columns[2]);
  const Vec<float> one = lanes<float>(1.0);
  const LaneCholesky root =
      cholesky({one + dot(L.columns[0], x), dot(L.columns[0], y), dot(L.columns[0], h),
                one + dot(L.columns[1], y), dot(L.columns[1], h), one + dot(L.columns[2], h)});
  const LaneTriple step = root.backward(root.forward(transposed_times(L, by_twist.gradient) - n));
  const LaneTriple twist = times(L, step);
  const Vec<float> length2 = twist.x * twist.x + twist.y * twist.y;
  return {n + step, root, length2 * (length2 * by_twist.by_length + twist.h * twist.h * by_twist.by_turn)};
}

/// Laplace's approximation of exp J, eq. 15, at its maximum: by Gauss–Newton until what is left is linear. A
/// lane that is there keeps its Gaussian while others go on: no lane sees what stands beside it.
HWY_INLINE LaneGaussian laplace_approximation(const NearReadings& near, const GaussianProposal& proposal,
                                              std::size_t i, const LaneMatrix& L) {
  constexpr int kMostSteps = 4;  // what has not converged then is weighed as it is: any proposal is unbiased
  constexpr double kLinear = 0.01;  // (0.1 σ)²: the linearisation errs by a tenth of a reading's noise
  const std::span<const NearReading> readings = near.all();
  const Vec<float> zero = hn::Zero(Tag<float>());
  const LaneSensor predicted = load_sensor(proposal.predicted, i);
  LaneTriple n = {zero, zero, zero};
  LaneSensor sensor = predicted;
  if (proposal.from != nullptr) {
    n = load_triple(*proposal.from, i);
    sensor = moved(predicted, times(L, n));
  }
  LaneGaussian g = gauss_newton(readings, sensor, i, L, n);
  for (int step = 1; step < kMostSteps; ++step) {
    const auto goes_on = g.nonlinear2 > lanes<float>(kLinear);
    if (hn::AllFalse(Tag<float>(), goes_on)) break;
    g = where(goes_on, gauss_newton(readings, moved(predicted, times(L, g.mean)), i, L, g.mean), g);
  }
  return g;
}

// Eq. 16.
void draw(const NearReadings& near, const GaussianProposal& proposal, ParticleRange range,
          TripleColumns& n_columns, double* log_weights) {
  constexpr double kFarthest = 1e6;  // [σ] beyond, numbers have failed and the motion has to do
  const auto is_near = [](Vec<float> x) HWY_ATTR { return hn::Abs(x) < lanes<float>(kFarthest); };
  const LaneMatrix L = matrix(proposal.L);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneGaussian g = laplace_approximation(near, proposal, i, L);
    const LaneTriple z = load_triple(proposal.z, i);
    const LaneTriple n = g.mean + g.root.backward(z);
    const auto is_sound = hn::And(hn::And(is_near(n.x), is_near(n.y)), is_near(n.h));
    const LaneTriple& inverse = g.root.inverse_diagonal;
    const Vec<float> log_ratio =
        lanes<float>(0.5) * (dot(z, z) - dot(n, n)) + log(inverse.x * inverse.y * inverse.h);
    store_triple(where(is_sound, n, z), n_columns, i);
    add(hn::IfThenElseZero(is_sound, log_ratio), log_weights + i);
  }
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(draw);

void draw_from_gaussians(const NearReadings& readings, const GaussianProposal& proposal, ParticleRange range,
                         TripleColumns& n, double* log_weights) {
  HWY_DYNAMIC_DISPATCH(draw)(readings, proposal, range, n, log_weights);
}

}  // namespace trundle::slam
#endif
