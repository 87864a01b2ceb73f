#pragma once

// Instruction sets that kernels are compiled for, each taking its time to compile: AVX-512, AVX2, SSE4 or
// NEON, and plain C++ (one lane), which every machine runs. Those whose vectors have no operators are left
// out. A kernel, <name>_kernels.cpp, includes this before Highway.
#ifndef HWY_DISABLED_TARGETS
#ifdef TRUNDLE_FEW_TARGETS  // what a sanitizer sees in AVX2 and plain C++ it would see in these again
#define TRUNDLE_SKIPPED_TARGETS (HWY_SSE4 | HWY_AVX3)
#else
#define TRUNDLE_SKIPPED_TARGETS 0
#endif
#define HWY_DISABLED_TARGETS                                                             \
  (HWY_SSSE3 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | \
   TRUNDLE_SKIPPED_TARGETS)
#endif
