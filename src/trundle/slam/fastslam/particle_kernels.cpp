#include "trundle/slam/fastslam/particle_kernels.hpp"

#include <limits>

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/fastslam/particle_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/fastslam/lane_columns.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

using Words = Vec<std::uint32_t>;

template <int kEven, int kOdd>
HWY_INLINE void round_of(Words& a, Words& b, Words& c, Words& d) {
  a = hn::Add(a, b);
  c = hn::Add(c, d);
  b = hn::Xor(hn::RotateRight<32 - kEven>(b), a);
  d = hn::Xor(hn::RotateRight<32 - kOdd>(d), c);
}

/// Threefry-4x32-20: 20 rounds, and a piece of the key after each fourth.
HWY_INLINE void encrypt(const std::array<std::uint32_t, 4>& key, Words& a, Words& b, Words& c, Words& d) {
  const Tag<std::uint32_t> tag;
  const std::array<std::uint32_t, 5> keys = {key[0], key[1], key[2], key[3],
                                             key[0] ^ key[1] ^ key[2] ^ key[3] ^ 0x1BD11BDAU};
  const auto inject = [&](std::uint32_t s) HWY_ATTR {
    a = hn::Add(a, hn::Set(tag, keys[s % 5]));
    b = hn::Add(b, hn::Set(tag, keys[(s + 1) % 5]));
    c = hn::Add(c, hn::Set(tag, keys[(s + 2) % 5]));
    d = hn::Add(d, hn::Set(tag, keys[(s + 3) % 5] + s));
  };
  inject(0);
  for (std::uint32_t s = 1; s <= 5; ++s) {
    if (s % 2 == 1) {
      round_of<10, 26>(a, b, c, d);
      round_of<11, 21>(a, d, c, b);
      round_of<13, 27>(a, b, c, d);
      round_of<23, 5>(a, d, c, b);
    } else {
      round_of<6, 20>(a, b, c, d);
      round_of<17, 11>(a, d, c, b);
      round_of<25, 10>(a, b, c, d);
      round_of<18, 20>(a, d, c, b);
    }
    inject(s);
  }
}

struct FourWords {
  Words a, b, c, d;
};

/// Of as many particles as there are lanes.
HWY_INLINE FourWords words_of(const Draw& draw, std::size_t first) {
  const Tag<std::uint32_t> tag;
  const std::array<std::uint32_t, 4> key = {static_cast<std::uint32_t>(draw.seed),
                                            static_cast<std::uint32_t>(draw.seed >> 32U), draw.purpose, 0};
  FourWords words{hn::Iota(tag, static_cast<std::uint32_t>(first)),
                  hn::Set(tag, static_cast<std::uint32_t>(draw.step)),
                  hn::Set(tag, static_cast<std::uint32_t>(draw.step >> 32U)), hn::Zero(tag)};
  encrypt(key, words.a, words.b, words.c, words.d);
  return words;
}

/// (k + ½)/2²³ of the first 23 bits, exactly: in (0, 1).
HWY_INLINE Vec<float> uniform_of(Words word) {
  const Tag<float> d;
  const hn::RebindToSigned<Tag<float>> di;
  const Vec<float> k = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<9>(word)));
  return k * lanes<float>(0x1p-23) + lanes<float>(0x1p-24);
}

struct TwoNormals {
  Vec<float> first, second;
};

HWY_INLINE TwoNormals box_muller(Words radius, Words angle) {
  const Vec<float> r = hn::Sqrt(lanes<float>(-2.0) * log(uniform_of(radius)));
  const Vec<float> shifted = uniform_of(angle) * lanes<float>(4.0) + lanes<float>(0x1.8p23);
  const Vec<float> quarters = shifted - lanes<float>(0x1.8p23);
  const Vec<float> rest = (uniform_of(angle) - quarters * lanes<float>(0.25)) * lanes<float>(2.0 * kPi);
  const SinCos<Vec<float>> at =
      sin_cos_in_quadrant(rest, hn::BitCast(hn::RebindToSigned<Tag<float>>(), shifted));
  return {r * at.cos, r * at.sin};
}

void normals(const Draw& draw, ParticleRange range, TripleColumns& n) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const FourWords words = words_of(draw, i);
    const TwoNormals xy = box_muller(words.a, words.b);
    store(xy.first, n[0] + i);
    store(xy.second, n[1] + i);
    store(box_muller(words.c, words.d).first, n[2] + i);
  }
}

void uniforms(const Draw& draw, ParticleRange range, TripleColumns& u) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const FourWords words = words_of(draw, i);
    store(uniform_of(words.a), u[0] + i);
    store(uniform_of(words.b), u[1] + i);
    store(uniform_of(words.c), u[2] + i);
  }
}

/// (k + ½)/2¹⁰ of ten bits.
template <int kFirst>
HWY_INLINE Vec<float> chance_of(Words word) {
  const Tag<float> d;
  const hn::RebindToSigned<Tag<float>> di;
  const Words ten_bits = hn::And(hn::ShiftRight<kFirst>(word), hn::Set(Tag<std::uint32_t>(), 1023));
  return hn::ConvertTo(d, hn::BitCast(di, ten_bits)) * lanes<float>(0x1p-10) + lanes<float>(0x1p-11);
}

HWY_INLINE void store_chances(Words word, TripleColumns& to, std::size_t i) {
  store(chance_of<22>(word), to[0] + i);
  store(chance_of<12>(word), to[1] + i);
  store(chance_of<2>(word), to[2] + i);
}

void chances(const Draw& draw, ParticleRange range, std::array<TripleColumns, 3>& to) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const FourWords words = words_of(draw, i);
    store_chances(words.a, to[0], i);
    store_chances(words.b, to[1], i);
    store_chances(words.c, to[2], i);
  }
}

void encrypt_one(const std::array<std::uint32_t, 4>& key, std::array<std::uint32_t, 4>& words) {
  const Tag<std::uint32_t> tag;
  Words a = hn::Set(tag, words[0]);
  Words b = hn::Set(tag, words[1]);
  Words c = hn::Set(tag, words[2]);
  Words d = hn::Set(tag, words[3]);
  encrypt(key, a, b, c, d);
  words = {hn::GetLane(a), hn::GetLane(b), hn::GetLane(c), hn::GetLane(d)};
}

struct WidePose {
  Wide x, y, heading;
};

HWY_INLINE WidePose load_pose(const PoseColumns& poses, std::size_t i) {
  const Tag<double> d;
  return {hn::Load(d, poses[0] + i), hn::Load(d, poses[1] + i), hn::Load(d, poses[2] + i)};
}

HWY_INLINE void store_pose(const WidePose& pose, PoseColumns& poses, std::size_t i) {
  const Tag<double> d;
  hn::Store(pose.x, d, poses[0] + i);
  hn::Store(pose.y, d, poses[1] + i);
  hn::Store(pose.heading, d, poses[2] + i);
}

struct WideTwist {
  Wide dx, dy, turn;
};

/// A matrix times what each particle has.
HWY_INLINE WideTwist times(const Matrix3& A, const TripleColumns& v, std::size_t i) {
  const Tag<double> d;
  const Wide v0 = hn::Load(d, v[0] + i);
  const Wide v1 = hn::Load(d, v[1] + i);
  const Wide v2 = hn::Load(d, v[2] + i);
  const auto row = [&](int k) HWY_ATTR {
    return lanes<double>(A(k, 0)) * v0 + lanes<double>(A(k, 1)) * v1 + lanes<double>(A(k, 2)) * v2;
  };
  return {row(0), row(1), row(2)};
}

struct Arc {
  WidePose end;
  SinCos<Wide> heading;  ///< there
};

/// pose · exp(twist): a chord of the length of the path times sin(u)/u, u half the turn, in the direction of
/// the middle of the turn. docs/theory/odometry.md, eq. 3.
HWY_INLINE Arc moved(const WidePose& pose, const WideTwist& twist) {
  const Wide u = lanes<double>(0.5) * twist.turn;
  const SinCos<Wide> half = sin_cos(u);
  const SinCos<Wide> middle = sin_cos(pose.heading + u);
  const auto tiny = hn::Abs(u) < lanes<double>(1e-4);
  const Wide sinc = hn::IfThenElse(tiny, lanes<double>(1.0) - u * u * lanes<double>(1.0 / 6.0),
                                   half.sin / hn::IfThenElse(tiny, lanes<double>(1.0), u));
  const Wide along = sinc * twist.dx;
  const Wide across = sinc * twist.dy;
  return {{pose.x + (middle.cos * along - middle.sin * across),
           pose.y + (middle.sin * along + middle.cos * across), pose.heading + twist.turn},
          {middle.sin * half.cos + middle.cos * half.sin, middle.cos * half.cos - middle.sin * half.sin}};
}

/// S s + offset of each particle.
HWY_INLINE WideTwist systematic_twist(const PredictedMotion& motion, const SystematicColumns& systematic,
                                      std::size_t i) {
  const Tag<double> d;
  const Vector3& offset = motion.offset;
  WideTwist twist{lanes<double>(offset[0]), lanes<double>(offset[1]), lanes<double>(offset[2])};
  for (Eigen::Index k = 0; k < motion.by_systematic.cols(); ++k) {
    const Wide s = hn::Load(d, systematic[static_cast<std::size_t>(k)] + i);
    const auto by = motion.by_systematic.col(k);
    twist.dx = twist.dx + lanes<double>(by[0]) * s;
    twist.dy = twist.dy + lanes<double>(by[1]) * s;
    twist.turn = twist.turn + lanes<double>(by[2]) * s;
  }
  return twist;
}

// Eq. 9.
void predict_all(const PoseColumns& poses, const SystematicColumns& systematic, const PredictedMotion& motion,
                 ParticleRange range, PoseColumns& predicted) {
  const bool has_systematic = !motion.by_systematic.isZero(0.0) || !motion.offset.isZero(0.0);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<double>())) {
    WidePose pose = load_pose(poses, i);
    const SinCos<Wide> at = sin_cos(pose.heading);
    const Wide dx = lanes<double>(motion.mean.x);
    const Wide dy = lanes<double>(motion.mean.y);
    pose = {pose.x + (at.cos * dx - at.sin * dy), pose.y + (at.sin * dx + at.cos * dy),
            pose.heading + lanes<double>(motion.mean.heading)};
    if (has_systematic) pose = moved(pose, systematic_twist(motion, systematic, i)).end;
    store_pose(pose, predicted, i);
  }
}

void place_all(const PoseColumns& predicted, const TripleColumns& n, const Placement& placement,
               ParticleRange range, PoseColumns& poses, SensorColumns& sensors) {
  const Tag<double> d;
  const Pose2& B = placement.body_from_sensor;
  const Wide bx = lanes<double>(B.x);
  const Wide by = lanes<double>(B.y);
  const Wide bc = lanes<double>(std::cos(B.heading));
  const Wide bs = lanes<double>(std::sin(B.heading));
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const Arc arc = moved(load_pose(predicted, i), times(placement.L, n, i));
    store_pose(arc.end, poses, i);
    const auto& [s, c] = arc.heading;
    hn::Store((arc.end.x - lanes<double>(sensors.origin.x())) + (c * bx - s * by), d, sensors.x.data() + i);
    hn::Store((arc.end.y - lanes<double>(sensors.origin.y())) + (s * bx + c * by), d, sensors.y.data() + i);
    hn::Store(c * bc - s * bs, d, sensors.cos.data() + i);
    hn::Store(s * bc + c * bs, d, sensors.sin.data() + i);
  }
}

double normalise_all(ParticleRange range, double* log_weights, double* weights) {
  const Tag<double> d;
  const Wide none = lanes<double>(-std::numeric_limits<double>::infinity());
  Wide greatest = none;
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const Wide x = hn::Load(d, log_weights + i);
    const Wide sound = hn::IfThenElse(hn::Abs(x) < lanes<double>(1e300), x, none);
    hn::Store(sound, d, log_weights + i);
    greatest = hn::Max(greatest, sound);
  }
  greatest = hn::MaxOfLanes(d, greatest);
  if (hn::GetLane(greatest) == hn::GetLane(none)) return 0.0;
  ColumnSums sums;
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const Wide log_weight = hn::Load(d, log_weights + i) - greatest;
    const Wide weight = exp(log_weight);
    hn::Store(log_weight, d, log_weights + i);
    hn::Store(weight, d, weights + i);
    sums.add(i % kParticleLanes, weight);
  }
  const Wide scale = lanes<double>(1.0 / sums.sum());
  ColumnSums squares;
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const Wide weight = hn::Load(d, weights + i) * scale;
    hn::Store(weight, d, weights + i);
    squares.add(i % kParticleLanes, weight * weight);
  }
  return 1.0 / squares.sum();
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(normals);
HWY_EXPORT(uniforms);
HWY_EXPORT(chances);
HWY_EXPORT(encrypt_one);
HWY_EXPORT(predict_all);
HWY_EXPORT(place_all);
HWY_EXPORT(normalise_all);

void draw_normals(const Draw& draw, ParticleRange range, TripleColumns& n) {
  HWY_DYNAMIC_DISPATCH(normals)(draw, range, n);
}

void draw_uniforms(const Draw& draw, ParticleRange range, TripleColumns& u) {
  HWY_DYNAMIC_DISPATCH(uniforms)(draw, range, u);
}

void draw_chances(const Draw& draw, ParticleRange range, std::array<TripleColumns, 3>& to) {
  HWY_DYNAMIC_DISPATCH(chances)(draw, range, to);
}

std::array<std::uint32_t, 4> threefry(const std::array<std::uint32_t, 4>& counter,
                                      const std::array<std::uint32_t, 4>& key) {
  std::array<std::uint32_t, 4> words = counter;
  HWY_DYNAMIC_DISPATCH(encrypt_one)(key, words);
  return words;
}

void predict(const PoseColumns& poses, const SystematicColumns& systematic, const PredictedMotion& motion,
             ParticleRange range, PoseColumns& predicted) {
  HWY_DYNAMIC_DISPATCH(predict_all)(poses, systematic, motion, range, predicted);
}

void place(const PoseColumns& predicted, const TripleColumns& n, const Placement& placement,
           ParticleRange range, PoseColumns& poses, SensorColumns& sensors) {
  HWY_DYNAMIC_DISPATCH(place_all)(predicted, n, placement, range, poses, sensors);
}

double normalise(ParticleRange range, double* log_weights, double* weights) {
  return HWY_DYNAMIC_DISPATCH(normalise_all)(range, log_weights, weights);
}

}  // namespace trundle::slam
#endif
