// How lanes of floats get at columns of doubles, and how those are summed. Included once for each instruction
// set.
#if defined(TRUNDLE_SLAM_LANE_COLUMNS) == defined(HWY_TARGET_TOGGLE)
#ifdef TRUNDLE_SLAM_LANE_COLUMNS
#undef TRUNDLE_SLAM_LANE_COLUMNS
#else
#define TRUNDLE_SLAM_LANE_COLUMNS
#endif

#include "trundle/simd/lanes.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR
/// The doubles of one vector of floats.
struct TwoWide {
  using Tag64 = hn::Repartition<double, Tag<float>>;
  hn::Vec<Tag64> low, high;
};
HWY_INLINE TwoWide load_two(const double* from) {
  const TwoWide::Tag64 d;
  return {hn::Load(d, from), hn::Load(d, from + hn::Lanes(d))};
}
HWY_INLINE void store_two(const TwoWide& x, double* to) {
  const TwoWide::Tag64 d;
  hn::Store(x.low, d, to);
  hn::Store(x.high, d, to + hn::Lanes(d));
}
HWY_INLINE TwoWide promoted(Vec<float> x) {
  const TwoWide::Tag64 d;
  const hn::Half<Tag<float>> half;
  return {hn::PromoteTo(d, hn::LowerHalf(half, x)), hn::PromoteTo(d, hn::UpperHalf(half, x))};
}
HWY_INLINE Vec<float> demoted(const TwoWide& x) {
  const hn::Half<Tag<float>> half;
  return hn::Combine(Tag<float>(), hn::DemoteTo(half, x.high), hn::DemoteTo(half, x.low));
}
#else
struct TwoWide {
  Wide low;
};
HWY_INLINE TwoWide load_two(const double* from) {
  return {hn::Load(Tag<double>(), from)};
}
HWY_INLINE void store_two(const TwoWide& x, double* to) {
  hn::Store(x.low, Tag<double>(), to);
}
HWY_INLINE TwoWide promoted(Vec<float> x) {
  return {hn::PromoteTo(Tag<double>(), x)};
}
HWY_INLINE Vec<float> demoted(const TwoWide& x) {
  return hn::DemoteTo(Tag<float>(), x.low);
}
#endif

/// As many doubles as there are floats in a vector, rounded.
HWY_INLINE Vec<float> load(const double* from) {
  return demoted(load_two(from));
}

HWY_INLINE void store(Vec<float> x, double* to) {
  store_two(promoted(x), to);
}

/// to[i] += x[i], the sum in double.
HWY_INLINE void add(Vec<float> x, double* to) {
  TwoWide sum = load_two(to);
  const TwoWide more = promoted(x);
  sum.low = sum.low + more.low;
#if HWY_TARGET != HWY_SCALAR
  sum.high = sum.high + more.high;
#endif
  store_two(sum, to);
}

/// Sums by column of kParticleLanes, and then of the columns.
class ColumnSums {
 public:
  ColumnSums() { sums_.fill(lanes<double>(0.0)); }
  HWY_INLINE void add(std::size_t column, Wide x) {
    Wide& sum = sums_[column / hn::Lanes(Tag<double>())];
    sum = sum + x;
  }
  HWY_INLINE double sum() const {
    alignas(64) std::array<double, kParticleLanes> columns;
    const std::size_t width = hn::Lanes(Tag<double>());
    for (std::size_t k = 0; k < kParticleLanes; k += width)
      hn::Store(sums_[k / width], Tag<double>(), columns.data() + k);
    double all = 0.0;
    for (const double x : columns) all += x;
    return all;
  }

 private:
  std::array<Wide, kParticleLanes> sums_;  // as many as one lane each would need
};

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
