#pragma once

#include <cstdint>
#include <type_traits>

namespace trundle {

/// Eight rows at once, in the vector extension that GCC and Clang share: + − * and bit operations act on each
/// lane, rounded as for one double, so that a kernel written for `Real` gives the same bits in lanes and
/// alone.
inline constexpr int kLanes = 8;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using LaneBits = std::uint64_t __attribute__((vector_size(kLanes * sizeof(double))));

/// The unsigned integers of the same width.
template <class Real>
using BitsOf = std::conditional_t<std::is_same_v<Real, double>, std::uint64_t, LaneBits>;

}  // namespace trundle

// Functions on lanes are inlined into one kernel, which is compiled for several instruction sets and chosen
// when the program starts; none passes lanes across an interface.
#define TRUNDLE_INLINE [[gnu::always_inline]] inline
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define TRUNDLE_KERNEL __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define TRUNDLE_KERNEL
#endif
