#pragma once

#include <cstdlib>
#include <new>

// Counts every allocation of the program; included by one of its files.
namespace trundle::test {
inline std::size_t allocations = 0;
}

#ifndef __SANITIZE_ADDRESS__
// Where all of them end up: Eigen's do without operator new. The name is glibc's for its own.
extern "C" void* __libc_malloc(std::size_t size) noexcept;  // NOLINT(bugprone-reserved-identifier)
extern "C" void* malloc(std::size_t size) noexcept {
  ++trundle::test::allocations;
  return __libc_malloc(size);
}
#else
// malloc is the sanitizer's. The replaced operators are malloc and free on purpose; g++ 12 says so where it
// inlines only one of a pair.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

void* operator new(std::size_t size) {
  ++trundle::test::allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif
