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

template <class Real>
using LaneBody = LaneSensor<Real>;

template <class Real>
HWY_INLINE void store_body(const LaneBody<Real>& body, BodyColumns& to, std::size_t i) {
  store<Real>(body.x, to.x.data() + i);
  store<Real>(body.y, to.y.data() + i);
  store<Real>(body.cos, to.cos.data() + i);
  store<Real>(body.sin, to.sin.data() + i);
}

template <class Real>
HWY_INLINE LaneBody<Real> same(const SensorAt& body) {
  return {lanes<Real>(body.x), lanes<Real>(body.y), lanes<Real>(body.cos), lanes<Real>(body.sin)};
}

template <class Real>
HWY_INLINE LaneTriple<Real> same(const Vector3& v) {
  return {lanes<Real>(v.x()), lanes<Real>(v.y()), lanes<Real>(v.z())};
}

template <class Real>
HWY_INLINE LaneTriple<Real> scaled(Vec<Real> by, const LaneTriple<Real>& v) {
  return {by * v.x, by * v.y, by * v.h};
}

/// Coordinate by coordinate.
template <class Real>
HWY_INLINE LaneTriple<Real> products(const LaneTriple<Real>& a, const LaneTriple<Real>& b) {
  return {a.x * b.x, a.y * b.y, a.h * b.h};
}

template <class Real, class Mask>
HWY_INLINE LaneTriple<Real> where(Mask mask, const LaneTriple<Real>& yes, const LaneTriple<Real>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.h, no.h)};
}

template <class Real, class Mask>
HWY_INLINE LaneBody<Real> where(Mask mask, const LaneBody<Real>& yes, const LaneBody<Real>& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.cos, no.cos), hn::IfThenElse(mask, yes.sin, no.sin)};
}

/// Log(a⁻¹ b): docs/theory/odometry.md, eq. 3, the other way round.
template <class Real>
HWY_INLINE LaneTriple<Real> difference(const LaneBody<Real>& a, const LaneBody<Real>& b) {
  const Vec<Real> turn = atan2(a.cos * b.sin - a.sin * b.cos, a.cos * b.cos + a.sin * b.sin);
  const Vec<Real> u = lanes<Real>(0.5) * turn;
  const SinCos<Vec<Real>> half = sin_cos(u);
  const auto tiny = hn::Abs(u) < lanes<Real>(1e-4);
  const Vec<Real> one = lanes<Real>(1.0);
  const Vec<Real> stretch = hn::IfThenElse(tiny, one, u / hn::IfThenElse(tiny, one, half.sin));
  const Vec<Real> dx = b.x - a.x;
  const Vec<Real> dy = b.y - a.y;
  const Vec<Real> along = a.cos * dx + a.sin * dy;
  const Vec<Real> across = a.cos * dy - a.sin * dx;
  return {stretch * (half.cos * along + half.sin * across), stretch * (half.cos * across - half.sin * along),
          turn};
}

/// What a task says, in lanes.
template <class Real>
struct LaneTask {
  const SwarmTask& task;
  LaneMatrix<Real> L, inverse;
  LaneTriple<Real> reach;
  Vec<Real> lever_x, lever_y, cos, sin;

  explicit LaneTask(const SwarmTask& t)
      : task(t),
        L(matrix<Real>(t.L)),
        inverse(matrix<Real>(t.inverse)),
        reach(same<Real>(t.reach)),
        lever_x(lanes<Real>(t.sensor.x)),
        lever_y(lanes<Real>(t.sensor.y)),
        cos(lanes<Real>(t.sensor.cos)),
        sin(lanes<Real>(t.sensor.sin)) {}

  HWY_INLINE LaneSensor<Real> sensor(const LaneBody<Real>& body) const {
    return {body.x + (body.cos * lever_x - body.sin * lever_y),
            body.y + (body.sin * lever_x + body.cos * lever_y), body.cos * cos - body.sin * sin,
            body.sin * cos + body.cos * sin};
  }
  HWY_INLINE LaneTriple<Real> limited(const LaneTriple<Real>& twist) const {
    const auto limit = [](Vec<Real> x, Vec<Real> most)
                           HWY_ATTR { return hn::Max(hn::Min(x, most), hn::Zero(Tag<Real>()) - most); };
    return {limit(twist.x, reach.x), limit(twist.y, reach.y), limit(twist.h, reach.h)};
  }
  /// n, or the nearest within reach; one within reach stays the same to the last bit.
  HWY_INLINE LaneTriple<Real> reachable(const LaneTriple<Real>& n) const {
    const LaneTriple<Real> twist = times(L, n);
    const LaneTriple<Real> near = limited(twist);
    const auto inside = hn::And(hn::And(twist.x == near.x, twist.y == near.y), twist.h == near.h);
    return where(inside, n, times(inverse, near));
  }
  HWY_INLINE LaneTriple<Real> n_of(const LaneBody<Real>& predicted, const LaneBody<Real>& body) const {
    return times(inverse, limited(difference(predicted, body)));
  }
};

/// The landmark of a group of particles, or of one particle in all lanes.
template <class Real, bool kOfOne>
HWY_INLINE LaneLandmark<Real> landmark_of(const LandmarkColumns& columns, std::size_t i) {
  const Real* numbers = columns.numbers<Real>() + i;
  const std::size_t stride = columns.stride();
  if constexpr (!kOfOne) return load_landmark<Real>(numbers, stride);
  const Tag<Real> d;
  return {hn::Set(d, numbers[0]), hn::Set(d, numbers[stride]), hn::Set(d, numbers[2 * stride]),
          hn::Set(d, numbers[3 * stride]), hn::Set(d, numbers[4 * stride])};
}

template <class Real>
struct LanePlace {
  LaneTriple<Real> n;
  LaneBody<Real> at;
  Vec<Real> value, agreement;
};

// Eq. 15.
template <class Real, bool kOfOne>
HWY_INLINE LanePlace<Real> place_at(const LaneTask<Real>& given, const LaneBody<Real>& predicted,
                                    const LaneTriple<Real>& n, std::size_t i) {
  const SwarmTask& task = given.task;
  LanePlace<Real> place{n, moved(predicted, times(given.L, n)), lanes<Real>(-0.5) * dot(n, n),
                        hn::Zero(Tag<Real>())};
  const LaneSensor<Real> sensor = given.sensor(place.at);
  const Vec<Real> share = lanes<Real>(1.0 / static_cast<double>(task.readings.size()));
  Vec<Real> distance2 = hn::Zero(Tag<Real>());
  LogSum<Vec<Real>> densities2;
  for (const NearReading<Real>& reading : task.readings.in<Real>()) {
    const LaneFit<Real> fit = fit_of(sensor, reading, landmark_of<Real, kOfOne>(*reading.landmark, i));
    distance2 = distance2 + fit.distance2;
    densities2.add(fit.density2);
    if (task.wants_agreement)
      place.agreement = place.agreement + share * exp(lanes<Real>(-0.5) * fit.distance2);
  }
  place.value = place.value + lanes<Real>(0.5) * (densities2.sum() - distance2);
  return place;
}

template <class Real, class Mask>
HWY_INLINE void go_where(Mask mask, const LanePlace<Real>& place, std::size_t i, SwarmColumns& swarm) {
  store_triple(where(mask, place.n, load_triple<Real>(swarm.n, i)), swarm.n, i);
  store_body(where(mask, place.at, load_sensor<Real>(swarm.at, i)), swarm.at, i);
  store<Real>(hn::IfThenElse(mask, place.value, load<Real>(swarm.value.data() + i)), swarm.value.data() + i);
}

template <class Real>
HWY_INLINE void remember_if_better(const LanePlace<Real>& place, std::size_t i, SwarmColumns& swarm) {
  const Vec<Real> best = load<Real>(swarm.best_value.data() + i);
  const auto better = place.value > best;
  store_triple(where(better, place.n, load_triple<Real>(swarm.best_n, i)), swarm.best_n, i);
  store_body(where(better, place.at, load_sensor<Real>(swarm.best_at, i)), swarm.best_at, i);
  store<Real>(hn::IfThenElse(better, place.value, best), swarm.best_value.data() + i);
  store<Real>(hn::IfThenElse(better, place.agreement, load<Real>(swarm.best_agreement.data() + i)),
              swarm.best_agreement.data() + i);
}

template <class Real>
void start_as(const SwarmTask& task, const TripleColumns& n, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask<Real> given(task);
  const Vec<Real> zero = hn::Zero(Tag<Real>());
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LanePlace<Real> place = place_at<Real, false>(given, load_sensor<Real>(task.predicted, i),
                                                        given.reachable(load_triple<Real>(n, i)), i);
    store_triple(place.n, swarm.n, i);
    store_triple(place.n, swarm.best_n, i);
    store_triple<Real>({zero, zero, zero}, swarm.velocity, i);
    store_body(place.at, swarm.at, i);
    store_body(place.at, swarm.best_at, i);
    store<Real>(place.value, swarm.value.data() + i);
    store<Real>(place.value, swarm.best_value.data() + i);
    store<Real>(place.agreement, swarm.best_agreement.data() + i);
  }
}

// Eq. 19.
template <class Real>
void compete_as(const SwarmTask& task, const Competition& by, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask<Real> given(task);
  const Vec<Real> one = lanes<Real>(1.0);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneBody<Real> predicted = load_sensor<Real>(task.predicted, i);
    const LaneBody<Real> partner = load_sensor<Real>(by.partners, i);
    const LaneTriple<Real> chance = load_triple<Real>(by.chances, i);
    const LaneTriple<Real> r = {chance.x + chance.x - one, chance.y + chance.y - one,
                                chance.h + chance.h - one};
    const LaneTriple<Real> step = products(r, difference(partner, load_sensor<Real>(swarm.at, i)));
    const LanePlace<Real> place =
        place_at<Real, false>(given, predicted, given.n_of(predicted, moved(partner, step)), i);
    const Vec<Real> value = load<Real>(swarm.value.data() + i);
    const auto has_partner = load<Real>(by.partner_values.data() + i) > value;
    const auto rises = hn::And(has_partner, place.value > value);
    remember_if_better<Real>({place.n, place.at, hn::IfThenElse(rises, place.value, value), place.agreement},
                             i, swarm);
    go_where<Real>(rises, place, i, swarm);
  }
}

// Eq. 20.
template <class Real>
void fly_as(const SwarmTask& task, const Flight& by, ParticleRange range, SwarmColumns& swarm) {
  const LaneTask<Real> given(task);
  const LaneBody<Real> leader = same<Real>(by.leader);
  const Vec<Real> inertia = lanes<Real>(by.inertia);
  const Vec<Real> cognitive = lanes<Real>(by.cognitive);
  const Vec<Real> social = lanes<Real>(by.social);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneBody<Real> predicted = load_sensor<Real>(task.predicted, i);
    const LaneBody<Real> here = load_sensor<Real>(swarm.at, i);
    const LaneTriple<Real> to_own = difference(here, load_sensor<Real>(swarm.best_at, i));
    const LaneTriple<Real> to_all = difference(here, leader);
    const LaneTriple<Real> velocity =
        scaled(inertia, load_triple<Real>(swarm.velocity, i)) +
        scaled(cognitive, products(load_triple<Real>(by.chances_of_own, i), to_own)) +
        scaled(social, products(load_triple<Real>(by.chances_of_all, i), to_all));
    store_triple(velocity, swarm.velocity, i);
    const LanePlace<Real> place =
        place_at<Real, false>(given, predicted, given.n_of(predicted, moved(here, velocity)), i);
    store_triple(place.n, swarm.n, i);
    store_body(place.at, swarm.at, i);
    store<Real>(place.value, swarm.value.data() + i);
    remember_if_better(place, i, swarm);
  }
}

template <class Real>
void search_as(const SwarmTask& task, const Search& by, ParticleRange range, SearchedPlaces& found) {
  const LaneTask<Real> given(task);
  const LaneBody<Real> predicted = same<Real>(task.predicted.at(by.particle));
  const LaneTriple<Real> centre = same<Real>(by.centre);
  const Vec<Real> radius = lanes<Real>(by.radius);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneTriple<Real> n = centre + scaled(radius, load_triple<Real>(by.offsets, i));
    const LanePlace<Real> place = place_at<Real, true>(given, predicted, given.reachable(n), by.particle);
    store_triple(place.n, found.n, i);
    store_body(place.at, found.at, i);
    store<Real>(place.value, found.value.data() + i);
    store<Real>(place.agreement, found.agreement.data() + i);
  }
}

bool is_single(const SwarmTask& task) {
  return task.readings.precision() == Precision::float32;
}

void start_all(const SwarmTask& task, const TripleColumns& n, ParticleRange range, SwarmColumns& swarm) {
  is_single(task) ? start_as<float>(task, n, range, swarm) : start_as<double>(task, n, range, swarm);
}

void compete_all(const SwarmTask& task, const Competition& by, ParticleRange range, SwarmColumns& swarm) {
  is_single(task) ? compete_as<float>(task, by, range, swarm) : compete_as<double>(task, by, range, swarm);
}

void fly_all(const SwarmTask& task, const Flight& by, ParticleRange range, SwarmColumns& swarm) {
  is_single(task) ? fly_as<float>(task, by, range, swarm) : fly_as<double>(task, by, range, swarm);
}

void search_all(const SwarmTask& task, const Search& by, ParticleRange range, SearchedPlaces& found) {
  is_single(task) ? search_as<float>(task, by, range, found) : search_as<double>(task, by, range, found);
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
