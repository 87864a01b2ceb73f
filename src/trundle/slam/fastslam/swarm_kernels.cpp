#include "trundle/slam/fastslam/swarm_kernels.hpp"

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/fastslam/swarm_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/fastslam/lane_sight.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

using LaneBody = LaneSensor;

HWY_INLINE void store_body(const LaneBody& body, BodyColumns& to, std::size_t i) {
  store(body.x, to.x.data() + i);
  store(body.y, to.y.data() + i);
  store(body.cos, to.cos.data() + i);
  store(body.sin, to.sin.data() + i);
}

HWY_INLINE LaneBody same(const SensorAt& body) {
  return {lanes<float>(body.x), lanes<float>(body.y), lanes<float>(body.cos), lanes<float>(body.sin)};
}

HWY_INLINE LaneTriple same(const Vector3& v) {
  return {lanes<float>(v.x()), lanes<float>(v.y()), lanes<float>(v.z())};
}

HWY_INLINE LaneTriple scaled(Vec<float> by, const LaneTriple& v) {
  return {by * v.x, by * v.y, by * v.h};
}

/// Coordinate by coordinate.
HWY_INLINE LaneTriple products(const LaneTriple& a, const LaneTriple& b) {
  return {a.x * b.x, a.y * b.y, a.h * b.h};
}

template <class Mask>
HWY_INLINE LaneBody where(Mask mask, const LaneBody& yes, const LaneBody& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.cos, no.cos), hn::IfThenElse(mask, yes.sin, no.sin)};
}

/// Log(a⁻¹ b): docs/theory/odometry.md, eq. 3, the other way round.
HWY_INLINE LaneTriple difference(const LaneBody& a, const LaneBody& b) {
  const Vec<float> turn = atan2(a.cos * b.sin - a.sin * b.cos, a.cos * b.cos + a.sin * b.sin);
  const Vec<float> u = lanes<float>(0.5) * turn;
  const SinCos<Vec<float>> half = sin_cos(u);
  const auto tiny = hn::Abs(u) < lanes<float>(1e-4);
  const Vec<float> one = lanes<float>(1.0);
  const Vec<float> stretch = hn::IfThenElse(tiny, one, u / hn::IfThenElse(tiny, one, half.sin));
  const Vec<float> dx = b.x - a.x;
  const Vec<float> dy = b.y - a.y;
  const Vec<float> along = a.cos * dx + a.sin * dy;
  const Vec<float> across = a.cos * dy - a.sin * dx;
  return {stretch * (half.cos * along + half.sin * across), stretch * (half.cos * across - half.sin * along),
          turn};
}

/// What a task says, in lanes.
struct LaneTask {
  const SwarmTask& task;
  LaneMatrix L, inverse;
  LaneTriple reach;
  Vec<float> lever_x, lever_y, cos, sin;

  explicit LaneTask(const SwarmTask& t)
      : task(t),
        L(matrix(t.L)),
        inverse(matrix(t.inverse)),
        reach(same(t.reach)),
        lever_x(lanes<float>(t.sensor.x)),
        lever_y(lanes<float>(t.sensor.y)),
        cos(lanes<float>(t.sensor.cos)),
        sin(lanes<float>(t.sensor.sin)) {}

  HWY_INLINE LaneSensor sensor(const LaneBody& body) const {
    return {body.x + (body.cos * lever_x - body.sin * lever_y),
            body.y + (body.sin * lever_x + body.cos * lever_y), body.cos * cos - body.sin * sin,
            body.sin * cos + body.cos * sin};
  }
  HWY_INLINE LaneTriple limited(const LaneTriple& twist) const {
    const auto limit = [](Vec<float> x, Vec<float> most)
                           HWY_ATTR { return hn::Max(hn::Min(x, most), hn::Zero(Tag<float>()) - most); };
    return {limit(twist.x, reach.x), limit(twist.y, reach.y), limit(twist.h, reach.h)};
  }
  /// n, or the nearest within reach; one within reach stays the same to the last bit.
  HWY_INLINE LaneTriple reachable(const LaneTriple& n) const {
    const LaneTriple twist = times(L, n);
    const LaneTriple near = limited(twist);
    const auto inside = hn::And(hn::And(twist.x == near.x, twist.y == near.y), twist.h == near.h);
    return where(inside, n, times(inverse, near));
  }
  HWY_INLINE LaneTriple n_of(const LaneBody& predicted, const LaneBody& body) const {
    return times(inverse, limited(difference(predicted, body)));
  }
};

/// The landmark of a group of particles, or of one particle in all lanes.
template <bool kOfOne>
HWY_INLINE LaneLandmark landmark_of(const LandmarkColumns& columns, std::size_t i) {
  const float* numbers = columns.numbers() + i;
  const std::size_t stride = columns.stride();
  if constexpr (!kOfOne) return load_landmark(numbers, stride);
  const Tag<float> d;
  return {hn::Set(d, numbers[0]), hn::Set(d, numbers[stride]), hn::Set(d, numbers[2 * stride]),
          hn::Set(d, numbers[3 * stride]), hn::Set(d, numbers[4 * stride])};
}

struct LanePlace {
  LaneTriple n;
  LaneBody at;
  Vec<float> value, agreement;
};

// Eq. 15.
template <bool kOfOne>
HWY_INLINE LanePlace place_at(const LaneTask& given, const LaneBody& predicted, const LaneTriple& n,
                              std::size_t i) {
  const SwarmTask& task = given.task;
  LanePlace place{n, moved(predicted, times(given.L, n)), lanes<float>(-0.5) * dot(n, n),
                  hn::Zero(Tag<float>())};
  const LaneSensor sensor = given.sensor(place.at);
  const Vec<float> share = lanes<float>(1.0 / static_cast<double>(task.readings.all().size()));
  Vec<float> distance2 = hn::Zero(Tag<float>());
  LogSum<Vec<float>> densities2;
  for (const NearReading& reading : task.readings.all()) {
    const LaneFit fit = fit_of(sensor, reading, landmark_of<kOfOne>(*reading.landmark, i));
    distance2 = distance2 + fit.distance2;
    densities2.add(fit.density2);
    if (task.wants_agreement)
      place.agreement = place.agreement + share * exp(lanes<float>(-0.5) * fit.distance2);
  }
  place.value = place.value + lanes<float>(0.5) * (densities2.sum() - distance2);
  return place;
}

template <class Mask>
HWY_INLINE void go_where(Mask mask, const LanePlace& place, std::size_t i, SwarmColumns& swarm) {
  store_triple(where(mask, place.n, load_triple(swarm.n, i)), swarm.n, i);
  store_body(where(mask, place.at, load_sensor(swarm.at, i)), swarm.at, i);
  store(hn::IfThenElse(mask, place.value, load(swarm.value.data() + i)), swarm.value.data() + i);
}

HWY_INLINE void remember_if_better(const LanePlace& place, std::size_t i, SwarmColumns& swarm) {
  const Vec<float> best = load(swarm.best_value.data() + i);
  const auto better = place.value > best;
  store_triple(where(better, place.n, load_triple(swarm.best_n, i)), swarm.best_n, i);
  store_body(where(better, place.at, load_sensor(swarm.best_at, i)), swarm.best_at, i);
  store(hn::IfThenElse(better, place.value, best), swarm.best_value.data() + i);
  store(hn::IfThenElse(better, place.agreement, load(swarm.best_agreement.data() + i)),
        swarm.best_agreement.data() + i);
}

void start_all(const SwarmTask& task, const TripleColumns& n, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask given(task);
  const Vec<float> zero = hn::Zero(Tag<float>());
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LanePlace place =
        place_at<false>(given, load_sensor(task.predicted, i), given.reachable(load_triple(n, i)), i);
    store_triple(place.n, swarm.n, i);
    store_triple(place.n, swarm.best_n, i);
    store_triple({zero, zero, zero}, swarm.velocity, i);
    store_body(place.at, swarm.at, i);
    store_body(place.at, swarm.best_at, i);
    store(place.value, swarm.value.data() + i);
    store(place.value, swarm.best_value.data() + i);
    store(place.agreement, swarm.best_agreement.data() + i);
  }
}

// Eq. 19.
void compete_all(const SwarmTask& task, const Competition& by, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask given(task);
  const Vec<float> one = lanes<float>(1.0);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneBody predicted = load_sensor(task.predicted, i);
    const LaneBody partner = load_sensor(by.partners, i);
    const LaneTriple chance = load_triple(by.chances, i);
    const LaneTriple r = {chance.x + chance.x - one, chance.y + chance.y - one, chance.h + chance.h - one};
    const LaneTriple step = products(r, difference(partner, load_sensor(swarm.at, i)));
    const LanePlace place = place_at<false>(given, predicted, given.n_of(predicted, moved(partner, step)), i);
    const Vec<float> value = load(swarm.value.data() + i);
    const auto has_partner = load(by.partner_values.data() + i) > value;
    const auto rises = hn::And(has_partner, place.value > value);
    remember_if_better({place.n, place.at, hn::IfThenElse(rises, place.value, value), place.agreement}, i,
                       swarm);
    go_where(rises, place, i, swarm);
  }
}

// Eq. 20.
void fly_all(const SwarmTask& task, const Flight& by, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask given(task);
  const LaneBody leader = same(by.leader);
  const Vec<float> inertia = lanes<float>(by.inertia);
  const Vec<float> cognitive = lanes<float>(by.cognitive);
  const Vec<float> social = lanes<float>(by.social);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneBody predicted = load_sensor(task.predicted, i);
    const LaneBody here = load_sensor(swarm.at, i);
    const LaneTriple to_own = difference(here, load_sensor(swarm.best_at, i));
    const LaneTriple to_all = difference(here, leader);
    const LaneTriple velocity = scaled(inertia, load_triple(swarm.velocity, i)) +
                                scaled(cognitive, products(load_triple(by.chances_of_own, i), to_own)) +
                                scaled(social, products(load_triple(by.chances_of_all, i), to_all));
    store_triple(velocity, swarm.velocity, i);
    const LanePlace place =
        place_at<false>(given, predicted, given.n_of(predicted, moved(here, velocity)), i);
    store_triple(place.n, swarm.n, i);
    store_body(place.at, swarm.at, i);
    store(place.value, swarm.value.data() + i);
    remember_if_better(place, i, swarm);
  }
}

void search_all(const SwarmTask& task, const Search& by, ParticleRange range, SearchedPlaces& found) {
  const LaneTask given(task);
  const LaneBody predicted = same(task.predicted.at(by.particle));
  const LaneTriple centre = same(by.centre);
  const Vec<float> radius = lanes<float>(by.radius);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneTriple n = centre + scaled(radius, load_triple(by.offsets, i));
    const LanePlace place = place_at<true>(given, predicted, given.reachable(n), by.particle);
    store_triple(place.n, found.n, i);
    store_body(place.at, found.at, i);
    store(place.value, found.value.data() + i);
    store(place.agreement, found.agreement.data() + i);
  }
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(start_all);
HWY_EXPORT(compete_all);
HWY_EXPORT(fly_all);
HWY_EXPORT(search_all);

void start_swarm(const SwarmTask& task, const TripleColumns& n, ParticleRange range, SwarmColumns& swarm) {
  HWY_DYNAMIC_DISPATCH(start_all)(task, n, range, swarm);
}

void compete(const SwarmTask& task, const Competition& by, ParticleRange range, SwarmColumns& swarm) {
  HWY_DYNAMIC_DISPATCH(compete_all)(task, by, range, swarm);
}

void fly(const SwarmTask& task, const Flight& by, ParticleRange range, SwarmColumns& swarm) {
  HWY_DYNAMIC_DISPATCH(fly_all)(task, by, range, swarm);
}

void search_around(const SwarmTask& task, const Search& by, ParticleRange range, SearchedPlaces& found) {
  HWY_DYNAMIC_DISPATCH(search_all)(task, by, range, found);
}

}  // namespace trundle::slam
#endif
