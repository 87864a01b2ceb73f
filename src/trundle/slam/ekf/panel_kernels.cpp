#include "trundle/slam/ekf/panel_kernels.hpp"

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/ekf/panel_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/simd/lanes.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

using Index = Eigen::Index;
using PanelTag = hn::CappedTag<double, PackedPanels::kRows>;
using PanelLanes = hn::Vec<PanelTag>;
constexpr std::size_t kParts = PackedPanels::kRows / hn::MaxLanes(PanelTag());

/// The eight rows of a panel's column, in as many vectors as that takes.
struct Rows {
  std::array<PanelLanes, kParts> part;
};

HWY_INLINE Rows load(const double* from) {
  Rows x;
  for (std::size_t i = 0; i < kParts; ++i)
    x.part[i] = hn::LoadU(PanelTag(), from + i * hn::Lanes(PanelTag()));
  return x;
}
HWY_INLINE void store(const Rows& x, double* to) {
  for (std::size_t i = 0; i < kParts; ++i) hn::StoreU(x.part[i], PanelTag(), to + i * hn::Lanes(PanelTag()));
}
HWY_INLINE Rows operator*(const Rows& x, double factor) {
  Rows y;
  for (std::size_t i = 0; i < kParts; ++i) y.part[i] = x.part[i] * hn::Set(PanelTag(), factor);
  return y;
}
HWY_INLINE Rows operator+(const Rows& x, const Rows& y) {
  Rows z;
  for (std::size_t i = 0; i < kParts; ++i) z.part[i] = x.part[i] + y.part[i];
  return z;
}
HWY_INLINE Rows operator-(const Rows& x, const Rows& y) {
  Rows z;
  for (std::size_t i = 0; i < kParts; ++i) z.part[i] = x.part[i] - y.part[i];
  return z;
}

/// Eight rows and four columns of C, which stay in registers.
HWY_INLINE void subtract_tile(const double* a, const double* b, Index columns, double* c, Index stride) {
  Rows c0 = load(c);
  Rows c1 = load(c + stride);
  Rows c2 = load(c + 2 * stride);
  Rows c3 = load(c + 3 * stride);
  for (Index k = 0; k < columns; ++k, a += PackedPanels::kRows, b += PackedPanels::kRows) {
    const Rows x = load(a);
    c0 = c0 - x * b[0];
    c1 = c1 - x * b[1];
    c2 = c2 - x * b[2];
    c3 = c3 - x * b[3];
  }
  store(c0, c);
  store(c1, c + stride);
  store(c2, c + 2 * stride);
  store(c3, c + 3 * stride);
}

// Down the columns of C: what is written lies in memory in the same order.
void subtract_all(const PanelFactors& f, double* c, Index stride) {
  const Index size = PackedPanels::kRows * f.columns;
  for (Index j = 0; j < f.b_panels; ++j)
    for (Index half = 0; half < 2; ++half)
      for (Index i = f.lower ? j : 0; i < f.a_panels; ++i)
        subtract_tile(f.a + i * size, f.b + j * size + 4 * half, f.columns,
                      c + PackedPanels::kRows * i + (PackedPanels::kRows * j + 4 * half) * stride, stride);
}

void sum_columns(const double* matrix, Index stride, Index panels, std::span<const PackedPanels::Sum> sums,
                 double* to) {
  for (Index i = 0; i < panels; ++i)
    for (const PackedPanels::Sum& sum : sums) {
      const double* from = matrix + PackedPanels::kRows * i;
      Rows x = load(from + sum.columns[0] * stride) * sum.weights[0];
      for (std::size_t k = 1; k < sum.columns.size(); ++k)
        x = x + load(from + sum.columns[k] * stride) * sum.weights[k];
      store(x, to);
      to += PackedPanels::kRows;
    }
}

void divide_all(const double* L, Index stride, Index panels, Index columns, double* x) {
  for (Index i = 0; i < panels; ++i, x += PackedPanels::kRows * columns)
    for (Index k = 0; k < columns; ++k) {
      const Rows y = load(x + PackedPanels::kRows * k) * (1.0 / L[k + k * stride]);
      store(y, x + PackedPanels::kRows * k);
      for (Index j = k + 1; j < columns; ++j)
        store(load(x + PackedPanels::kRows * j) - y * L[j + k * stride], x + PackedPanels::kRows * j);
    }
}

void add_all(const double* x, Index panels, Index columns, const double* v, double* y) {
  for (Index i = 0; i < panels; ++i, y += PackedPanels::kRows) {
    Rows sum = load(y);
    for (Index k = 0; k < columns; ++k, x += PackedPanels::kRows) sum = sum + load(x) * v[k];
    store(sum, y);
  }
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(subtract_all);
HWY_EXPORT(sum_columns);
HWY_EXPORT(divide_all);
HWY_EXPORT(add_all);

void subtract_panels(const PanelFactors& factors, double* c, Eigen::Index stride) {
  HWY_DYNAMIC_DISPATCH(subtract_all)(factors, c, stride);
}

void sum_panels(const double* matrix, Eigen::Index stride, Eigen::Index panels,
                std::span<const PackedPanels::Sum> sums, double* to) {
  HWY_DYNAMIC_DISPATCH(sum_columns)(matrix, stride, panels, sums, to);
}

void divide_panels(const double* L, Eigen::Index stride, Eigen::Index panels, Eigen::Index columns,
                   double* x) {
  HWY_DYNAMIC_DISPATCH(divide_all)(L, stride, panels, columns, x);
}

void add_panels(const double* x, Eigen::Index panels, Eigen::Index columns, const double* v, double* y) {
  HWY_DYNAMIC_DISPATCH(add_all)(x, panels, columns, v, y);
}

}  // namespace trundle::slam
#endif
